#pragma once
// What a fuzz target says when a promise is broken.

#include <cstdio>
#include <cstdlib>
#include <string>

namespace energymargin::fuzz {

//! Ends the process, which libFuzzer reports with the input that did it.
inline void require(bool kept, const std::string& promise) {
  if (kept) return;
  std::fprintf(stderr, "broken: %s\n", promise.c_str());
  std::abort();
}

}  // namespace energymargin::fuzz

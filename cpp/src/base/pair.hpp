#pragma once
// Two numbers at a time.

#include <cstring>

namespace energymargin {

//! Two numbers, in one register where the machine has some.
using Pair = double __attribute__((vector_size(2 * sizeof(double))));

inline Pair pair(const double* numbers) {
  Pair both;
  std::memcpy(&both, numbers, sizeof both);
  return both;
}

}  // namespace energymargin

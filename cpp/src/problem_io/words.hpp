#pragma once
// Words of problem files' options.

#include "base/words.hpp"
#include "energymargin/problem_io.hpp"

namespace energymargin {

template <>
struct Words<Meshes> {
  static constexpr std::pair<const char*, Meshes> all[]{{"embedded", Meshes::embedded}, {"files", Meshes::files}};
};

}  // namespace energymargin

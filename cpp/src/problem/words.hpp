#pragma once
// Words of a problem.

#include "energymargin/problem.hpp"
#include "scene/words.hpp"

namespace energymargin {

template <>
struct Words<Effector> {
  static constexpr std::pair<const char*, Effector> all[]{{"coast", Effector::coast}, {"drive", Effector::drive}};
};

template <>
struct Words<Captured> {
  static constexpr std::pair<const char*, Captured> all[]{{"all", Captured::all}, {"any", Captured::any}};
};

}  // namespace energymargin

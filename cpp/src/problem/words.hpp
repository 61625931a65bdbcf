#pragma once
// Words of a scene and of a problem.

#include "base/words.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

template <>
struct Words<Role> {
  static constexpr std::pair<const char*, Role> all[]{
      {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
};

template <>
struct Words<JointType> {
  static constexpr std::pair<const char*, JointType> all[]{
      {"fixed", JointType::fixed}, {"revolute", JointType::revolute}, {"prismatic", JointType::prismatic}};
};

template <>
struct Words<Effector> {
  static constexpr std::pair<const char*, Effector> all[]{{"coast", Effector::coast}, {"drive", Effector::drive}};
};

}  // namespace energymargin

#pragma once
// Words of a scene.

#include "base/words.hpp"
#include "energymargin/scene.hpp"

namespace energymargin {

template <>
struct Words<Role> {
  static constexpr std::pair<const char*, Role> all[]{
      {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
};

template <>
struct Words<FrictionRule> {
  static constexpr std::pair<const char*, FrictionRule> all[]{{"product", FrictionRule::product},
                                                              {"max", FrictionRule::max}};
};

template <>
struct Words<JointType> {
  static constexpr std::pair<const char*, JointType> all[]{
      {"fixed", JointType::fixed}, {"revolute", JointType::revolute}, {"prismatic", JointType::prismatic}};
};

}  // namespace energymargin

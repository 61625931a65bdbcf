#pragma once
// What the values of a problem file are called.

#include <stdexcept>
#include <utility>
#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin::problem_io {

inline constexpr const char* format_name = "energymargin-problem";
inline constexpr int version_without_clock = 3;
inline constexpr int version_with_clock = 4;

inline const std::vector<std::pair<const char*, Role>> roles{
    {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
inline const std::vector<std::pair<const char*, JointType>> joint_types{
    {"fixed", JointType::fixed}, {"revolute", JointType::revolute}, {"prismatic", JointType::prismatic}};
inline const std::vector<std::pair<const char*, Effector>> effectors{{"coast", Effector::coast},
                                                                     {"drive", Effector::drive}};

template <typename Value>
const char* name_of(const std::vector<std::pair<const char*, Value>>& names, Value value) {
  for (const auto& [name, named] : names) {
    if (named == value) return name;
  }
  throw std::logic_error("a value without a name");
}

}  // namespace energymargin::problem_io

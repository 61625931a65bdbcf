#pragma once
// The name and the versions of the format of problem files.

namespace energymargin::problem_io {

inline constexpr const char* format_name = "energymargin-problem";
inline constexpr int version_with_clock = 4;
inline constexpr int version_with_friction_rule = 5;
inline constexpr int version_with_newton_solver = 6;

}  // namespace energymargin::problem_io

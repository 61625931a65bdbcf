#pragma once
// Angles [rad].

namespace energymargin {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double full_turn = 2.0 * pi;

}  // namespace energymargin

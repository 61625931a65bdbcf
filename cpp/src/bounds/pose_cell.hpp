#pragma once
// A box of poses of the object.

#include <algorithm>
#include <cmath>

#include "base/angles.hpp"
#include "energymargin/types.hpp"

namespace energymargin::bounds {

//! Position of the reference point [m], and the turn from the start about the one free axis [rad].
using Coordinates = Eigen::Vector4d;

inline constexpr int turn_axis = 3;  // of the coordinates

//! All coordinates between two.
struct PoseCell {
  Coordinates low = Coordinates::Zero();
  Coordinates high = Coordinates::Zero();

  Coordinates center() const { return 0.5 * (low + high); }
  Coordinates half() const { return 0.5 * (high - low); }
};

//! How far a point at a distance of 1 moves by a turn of up to so much.
inline double chord(double turn) { return 2.0 * std::sin(0.5 * std::min(turn, pi)); }

}  // namespace energymargin::bounds

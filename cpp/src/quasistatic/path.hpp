#pragma once
// Paths of the object: poses, and what lies between two of them.

#include <vector>

#include "energymargin/types.hpp"

namespace energymargin::quasistatic {

//! Poses from the start on; from one to the next the object moves evenly, and turns the shorter way.
using Path = std::vector<Pose>;

//! The pose at a share `t` of the way, 0..1.
Pose interpolate(const Pose& from, const Pose& to, double t);

//! Angle between two orientations, 0..pi [rad].
double angle(const Quaternion& a, const Quaternion& b);

}  // namespace energymargin::quasistatic

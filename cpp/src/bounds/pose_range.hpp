#pragma once
// The side of a region's edge on which a body is that may be anywhere in a range of poses.

#include "bounds/exit_energy.hpp"
#include "bounds/infinity.hpp"
#include "energymargin/region.hpp"

namespace energymargin::bounds {

constexpr CrossingEnergy surely_inside{infinity, 0.0};
constexpr CrossingEnergy surely_outside{0.0, infinity};
constexpr CrossingEnergy either{0.0, 0.0};

//! Where a body may be in a cell, and how it may be turned there.
struct PoseRange {
  Vector3 position, slack;  // of its point, along the axes of the world [m]
  Quaternion orientation;
  double turn;  // by which the orientation may differ [rad]

  // As seen from a frame that stays.
  PoseRange from(const BodyState& frame) const {
    const Quaternion back = frame.orientation.conjugate();
    return {back * (position - frame.position), back.toRotationMatrix().cwiseAbs() * slack, back * orientation, turn};
  }
};

struct Range {
  double low, high;
};

//! The least and the largest distance of a point from a centre, over the first axes [m].
Range distance(const PoseRange& at, const Vector3& center, int axes);

//! A value that lies between two is to be at most a limit.
CrossingEnergy at_most(double limit, double low, double high);

CrossingEnergy both(const CrossingEnergy& a, const CrossingEnergy& b);

CrossingEnergy in_sector(const regions::AnnularSector& sector, const PoseRange& at);

}  // namespace energymargin::bounds

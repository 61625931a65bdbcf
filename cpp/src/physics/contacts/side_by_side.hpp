#pragma once
// The closest points of a cylinder that stands along an axis of a box or of another cylinder.

#include <btBulletDynamicsCommon.h>

#include <optional>

#include "physics/contacts/core.hpp"

namespace energymargin {

//! The closest points of two cores.
struct CoreDistance {
  btVector3 normal;  // unit vector from b to a
  btVector3 on_b;    // in the world [m]
  double distance;   // [m]
};

//! GJK takes many rounds for two round sides that are close to each other. Side by side it is a question of a circle
//! and a rectangle, or of two circles; the points are half way up what the two share of their height. Unset if the axes
//! are not parallel, if one is above the other, or if the cores overlap.
std::optional<CoreDistance> distance_side_by_side(const Core& a, const btTransform& pose_a, const Core& b,
                                                  const btTransform& pose_b);

}  // namespace energymargin

#pragma once
// Closest points of two convex shapes.

#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <btBulletDynamicsCommon.h>

namespace energymargin {

using GjkInput = btDiscreteCollisionDetectorInterface::ClosestPointInput;
using GjkResult = btDiscreteCollisionDetectorInterface::Result;

//! What GJK does where the cores overlap: the shapes without their margins.
enum class Overlap {
  ignored,  ///< no points
  measured  ///< EPA's points, at the penetration depth
};

//! Bullet's GJK between the cores. Adds at most one point to `result`.
void closest_points(const btConvexShape& a, const btConvexShape& b, const GjkInput& input, GjkResult& result,
                    Overlap overlap = Overlap::measured);

//! The same at any distance.
btPointCollector closest_points(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                                const btTransform& pose_b, Overlap overlap);

}  // namespace energymargin

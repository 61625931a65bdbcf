#pragma once
// A convex hull with its margin inside, and the corners that it has with it.

#include <btBulletCollisionCommon.h>

#include <vector>

#include "energymargin/types.hpp"

namespace energymargin {

//! Bullet's hull is an inner shape with a margin around it, whose corners are round: its faces are smaller than those
//! of the points that it is made of. Where it lies on a face, or stands on a plane, these corners count, as a box's do.
class HullShape : public btConvexHullShape {
 public:
  //! The hull of points, with at most this margin [m].
  HullShape(const std::vector<Vector3>& points, double margin);

  const std::vector<btVector3>& corners() const { return corners_; }

  btVector3 localGetSupportingVertex(const btVector3& direction) const override;
  void getAabb(const btTransform& pose, btVector3& low, btVector3& high) const override;

 private:
  std::vector<btVector3> corners_;
  btVector3 low_, high_;
};

}  // namespace energymargin

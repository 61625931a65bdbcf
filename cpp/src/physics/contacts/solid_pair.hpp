#pragma once
// Two convex solids, and their closest points.

#include <btBulletDynamicsCommon.h>

#include <optional>

#include "physics/contacts/core_distance.hpp"

namespace energymargin {

//! Where two solids are closest.
struct ClosestContact {
  btVector3 normal;  // unit vector, from b to a
  btVector3 on_b;
  double distance;  // negative in penetration [m]
};

//! Bullet asks first whether the solids without their margins overlap, then how far apart they are, and then looks back
//! whether the normal is the wrong way round. Where they are found apart, as they nearly always are, that answers all
//! three; so Bullet is asked where they are not. A search begins where the last one of this pair ended.
class SolidPair {
 public:
  SolidPair(const btConvexShape& a, const btConvexShape& b) : a_(a), b_(b), cores_(a, b) {}

  const Core& core_a() const { return cores_.a(); }
  const Core& core_b() const { return cores_.b(); }
  double margin_a() const { return a_.getMarginNonVirtual(); }
  double margin_b() const { return b_.getMarginNonVirtual(); }

  //! None if they are farther than `reach` from each other [m].
  std::optional<ClosestContact> closest(const btTransform& pose_a, const btTransform& pose_b, double reach);

 private:
  const btConvexShape &a_, &b_;
  CorePair cores_;
};

}  // namespace energymargin

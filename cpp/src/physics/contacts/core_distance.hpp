#pragma once
// How far two cores are apart, by GJK.

#include <btBulletDynamicsCommon.h>

#include "physics/contacts/core.hpp"
#include "physics/contacts/side_by_side.hpp"

namespace energymargin {

enum class Cores {
  apart,     ///< the distance is known
  too_far,   ///< farther than was asked for
  too_near,  ///< they overlap, or nearly so: the direction is not known
};

//! Two cores. A search for their closest points begins with those that the last one ended with.
class CorePair {
 public:
  //! The shapes outlive this.
  CorePair(const btConvexShape& a, const btConvexShape& b) : a_(a), b_(b) {}

  const Core& a() const { return a_; }
  const Core& b() const { return b_; }

  //! The next search begins anew.
  void forget() { count_ = 0; }

  //! By GJK (Gilbert, Johnson and Keerthi 1988), but for cylinders side by side. Distances are asked for up to `reach`
  //! [m].
  Cores distance(const btTransform& pose_a, const btTransform& pose_b, double reach, CoreDistance& result);

 private:
  Core a_, b_;
  int count_ = 0;                // of the points that the last search ended with
  btVector3 on_a_[3], on_b_[3];  // in the cores' own frames
};

}  // namespace energymargin

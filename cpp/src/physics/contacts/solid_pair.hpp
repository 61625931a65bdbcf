#pragma once
// Two convex solids, and their closest points.

#include <optional>

#include "physics/contacts/inner_shape.hpp"

namespace energymargin {

//! Where two inner shapes are.
enum class Separation {
  apart,     ///< the distance is known
  too_far,   ///< farther than was asked for
  too_near,  ///< they penetrate each other, or nearly so: the direction is not known
};

//! What Bullet says of inner shapes that penetrate each other.
enum class Penetration {
  ignored,  ///< no points
  measured  ///< EPA's points, at the penetration depth
};

//! Our GJK answers where the inner shapes are apart, as they nearly always are: Bullet asks thrice, so it is asked only
//! where they are not. A search begins with the points that the last one of this pair ended with.
class SolidPair {
 public:
  //! The shapes outlive this.
  SolidPair(const btConvexShape& a, const btConvexShape& b) : shape_a_(a), shape_b_(b), a_(a), b_(b) {}

  const InnerShape& a() const { return a_; }
  const InnerShape& b() const { return b_; }

  //! The sum of both margins [m].
  double margins() const { return a_.margin() + b_.margin(); }

  //! The next search begins anew.
  void forget() { count_ = 0; }

  //! None if they are farther than `reach` from each other [m].
  std::optional<ClosestPoints> closest(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                       Penetration penetration = Penetration::measured);

  //! Closest points of the inner shapes, up to `reach` [m].
  Separation inner_distance(const btTransform& pose_a, const btTransform& pose_b, double reach, ClosestPoints& result);

  //! Bullet's closest points of the solids, up to `reach` [m].
  std::optional<ClosestPoints> closest_by_bullet(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                                 Penetration penetration) const;

 private:
  const btConvexShape &shape_a_, &shape_b_;
  InnerShape a_, b_;
  int count_ = 0;                // of the points that the last search ended with
  btVector3 on_a_[3], on_b_[3];  // in the shapes' own frames
};

//! The closest points of a cylinder that stands along an axis of a box or of another cylinder, for which GJK takes many
//! iterations: side by side it is a question of a circle and a rectangle, or of two circles. The points are half way up
//! what the two share of their height. Unset if the axes are not parallel, if one is above the other, or if the inner
//! shapes penetrate each other.
std::optional<ClosestPoints> distance_side_by_side(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                                   const btTransform& pose_b);

}  // namespace energymargin

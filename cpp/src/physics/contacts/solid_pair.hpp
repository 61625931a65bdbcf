#pragma once
// Two convex solids, and their closest points.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "physics/shapes.hpp"

namespace energymargin {

//! How edges and corners are seen. Spheres and capsules have none, and a margin of their own: their radius.
enum class Edges {
  rounded,  ///< by the collision margin
  sharp     ///< as they are
};

//! What is left of Bullet's box, sphere, capsule or cylinder, or of a HullShape, without its margin; with sharp edges
//! all of it, and the margin is 0. The shape outlives this.
class InnerShape {
 public:
  explicit InnerShape(const btConvexShape& shape, Edges edges = Edges::rounded)
      : kind_(shape.getShapeType()),
        half_(static_cast<const btConvexInternalShape&>(shape).getImplicitShapeDimensions()),
        margin_(shape.getMarginNonVirtual()),
        edges_(Edges::rounded) {
    if (is_hull()) hull_ = &static_cast<const HullShape&>(shape);
    if (edges == Edges::sharp) sharpen();
  }

  //! The axis of a cylinder with its radius around it: what it is to all that its round side meets.
  InnerShape side() const {
    InnerShape side = *this;
    side.kind_ = CAPSULE_SHAPE_PROXYTYPE;
    side.half_ += btVector3(margin_, margin_, margin_);
    side.margin_ = side.half_.x();
    return side;
  }

  //! The same with sharp edges.
  InnerShape sharp() const {
    InnerShape sharp = *this;
    sharp.sharpen();
    return sharp;
  }

  int kind() const { return kind_; }
  bool is_box() const { return kind_ == BOX_SHAPE_PROXYTYPE; }
  bool is_cylinder() const { return kind_ == CYLINDER_SHAPE_PROXYTYPE; }
  //! Whether it is a point or a line with a radius around it.
  bool is_round() const { return kind_ == SPHERE_SHAPE_PROXYTYPE || kind_ == CAPSULE_SHAPE_PROXYTYPE; }
  bool is_hull() const { return kind_ == CONVEX_HULL_SHAPE_PROXYTYPE; }

  //! Half of the size along each axis, of all but hulls.
  const btVector3& half() const { return half_; }

  //! The margin around it [m]: of a sphere or a capsule its radius.
  double margin() const { return margin_; }

  //! Calls `visit` with the corners of a box or a hull, with its margin, in its own frame.
  template <typename Visit>
  void for_each_corner(const Visit& visit) const {
    if (!is_box()) {
      for (const btVector3& corner : hull_->corners()) visit(corner);
      return;
    }
    const btVector3 half = half_ + btVector3(margin_, margin_, margin_);
    for (int i = 0; i < 8; ++i) {
      visit(btVector3(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(), i & 4 ? half.z() : -half.z()));
    }
  }

  //! Calls `visit` with those of a hull's corners that can be within `depth` of the farthest along a unit vector, or
  //! with all corners of a box [m].
  template <typename Visit>
  void for_each_corner_near(const btVector3& direction, double depth, const Visit& visit) const {
    if (is_hull()) return hull_->for_each_corner_near(direction, depth, visit);
    for_each_corner(visit);
  }

  //! How far a hull reaches along a direction, at least and at most.
  std::pair<double, double> extent(const btVector3& direction) const { return hull_->extent(direction); }

  //! Of a hull, not of a sliver: its face along a direction in its own frame. Else null.
  const HullShape::Face* face_along(const btVector3& direction) const {
    return hull_ && hull_->has_faces() ? &hull_->face_along(direction) : nullptr;
  }

  //! Calls `visit` with the normals and offsets [m] of its faces that are as near to a direction as the cosine `near`,
  //! all in its own frame: of a round side that across its axis.
  template <typename Visit>
  void for_each_face_near(const btVector3& direction, double near, const Visit& visit) const {
    if (hull_) return hull_->for_each_face_near(direction, near, visit);
    if (!is_box() && !is_cylinder()) return;
    for (int axis = is_box() ? 0 : 2; axis < 3; ++axis) {
      if (std::abs(direction[axis]) < near) continue;
      btVector3 normal(0.0, 0.0, 0.0);
      normal[axis] = direction[axis] < 0.0 ? -1.0 : 1.0;
      visit(normal, half_[axis] + margin_);
    }
    constexpr double least_across = 1e-9;
    const btVector3 across(direction.x(), direction.y(), 0.0);
    if (is_cylinder() && across.length() > std::max(near, least_across))
      visit(across.normalized(), half_.x() + margin_);
  }

  //! Of the box around it, without its margin [m].
  double size() const { return hull_ ? hull_->size() : half_.length(); }

  //! How far the solid reaches along a unit vector in its own frame, with sharp corners [m].
  double reach(const btVector3& direction) const {
    if (is_box()) return (half_ + btVector3(margin_, margin_, margin_)).dot(direction.absolute());
    if (is_cylinder()) {
      const double across = btSqrt(direction.x() * direction.x() + direction.y() * direction.y());
      return (half_.x() + margin_) * across + (half_.z() + margin_) * std::abs(direction.z());
    }
    if (!is_hull()) return direction.dot(support(direction)) + margin_;
    return direction.dot(hull_->farthest_corner(direction));
  }

  //! The farthest point along a direction, both in its own frame.
  btVector3 support(const btVector3& direction) const {
    const double end = direction.z() < 0.0 ? -half_.z() : half_.z();
    switch (kind_) {
      case BOX_SHAPE_PROXYTYPE:
        return {direction.x() >= 0.0 ? half_.x() : -half_.x(), direction.y() >= 0.0 ? half_.y() : -half_.y(),
                direction.z() >= 0.0 ? half_.z() : -half_.z()};
      case CYLINDER_SHAPE_PROXYTYPE: {
        const double across = btSqrt(direction.x() * direction.x() + direction.y() * direction.y());
        if (across == 0.0) return {half_.x(), 0.0, end};
        const double scale = half_.x() / across;
        return {direction.x() * scale, direction.y() * scale, end};
      }
      case CAPSULE_SHAPE_PROXYTYPE:
        return {0.0, 0.0, end};
      case CONVEX_HULL_SHAPE_PROXYTYPE:
        return edges_ == Edges::sharp ? hull_->farthest_corner(direction) : hull_->farthest_point(direction);
      default:  // sphere
        return {0.0, 0.0, 0.0};
    }
  }

 private:
  void sharpen() {
    edges_ = Edges::sharp;
    if (is_round()) return;
    if (!is_hull()) half_ += btVector3(margin_, margin_, margin_);
    margin_ = 0.0;
  }

  int kind_;
  btVector3 half_;
  double margin_;
  Edges edges_;
  const HullShape* hull_ = nullptr;  // if it is one
};

//! Inner shapes nearer than this penetrate each other, as far as one can tell: the direction between them is not known
//! [m]. A share of their margins makes small solids do what large ones do. Where both are sharp only the distance is
//! asked for.
inline double clearly_apart(const InnerShape& a, const InnerShape& b) {
  constexpr double most = 1e-5, share = 1e-3, of_sharp = 1e-10;
  return std::max(of_sharp * (a.size() + b.size()), std::min(most, share * (a.margin() + b.margin())));
}

//! The closest points of two solids or inner shapes.
struct ClosestPoints {
  btVector3 normal;  // unit vector, from b to a
  btVector3 on_b;    // in the world [m]
  double distance;   // negative in penetration [m]
};

//! Where two inner shapes are.
enum class Separation {
  apart,     ///< the distance is known
  too_far,   ///< farther than was asked for
  too_near,  ///< they penetrate each other, or nearly so: the direction is not known
};

//! What is said of inner shapes that penetrate each other.
enum class Penetration {
  ignored,  ///< no points
  measured  ///< EPA's points, at the penetration depth
};

//! Our GJK answers where the inner shapes are apart, as they nearly always are, and Bullet's EPA where they are not. A
//! search begins with the points that the last one of this pair ended with. What meets a sphere or a capsule has sharp
//! edges: a radius keeps the inner shapes as far apart as margins would.
class SolidPair {
 public:
  //! The shapes outlive this.
  SolidPair(const btConvexShape& a, const btConvexShape& b, Edges edges = Edges::rounded)
      : a_(a, is_round(b) ? Edges::sharp : edges), b_(b, is_round(a) ? Edges::sharp : edges) {}

  const InnerShape& a() const { return a_; }
  const InnerShape& b() const { return b_; }

  //! The sum of both margins [m].
  double margins() const { return a_.margin() + b_.margin(); }
  //! Whether rounded edges may meet.
  bool have_edges() const { return !a_.is_round() && !b_.is_round(); }

  //! How far the solids are apart along a unit vector from b to a, or less than nothing [m]: no more than their
  //! distance.
  double gap(const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal) const {
    return normal.dot(pose_a.getOrigin() - pose_b.getOrigin()) - a_.reach(-normal * pose_a.getBasis()) -
           b_.reach(normal * pose_b.getBasis());
  }

  //! The closest points of the solids from those of their inner shapes.
  ClosestPoints with_margins(const ClosestPoints& inner) const {
    return {inner.normal, inner.on_b + inner.normal * b_.margin(), inner.distance - margins()};
  }

  //! The next search begins anew.
  void forget() { count_ = 0; }

  //! None if they are farther than `reach` from each other [m].
  std::optional<ClosestPoints> closest(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                       Penetration penetration = Penetration::measured);

  //! Closest points of the inner shapes, up to `reach` [m].
  Separation inner_distance(const btTransform& pose_a, const btTransform& pose_b, double reach, ClosestPoints& result);

  //! The closest points of a cylinder's round side and the other solid with sharp edges, if those of rounded ones are
  //! there and not where sharp ones are; else `rounded`.
  ClosestPoints sharp_side(const btTransform& pose_a, const btTransform& pose_b, const ClosestPoints& rounded) const;

  //! The points of inner shapes that penetrate each other, at the penetration depth of the solids; none where they do
  //! not, or nearly so.
  std::optional<ClosestPoints> deepest(const btTransform& pose_a, const btTransform& pose_b) const;

 private:
  SolidPair(const InnerShape& a, const InnerShape& b) : a_(a), b_(b) {}
  ClosestPoints parted(const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal) const;
  static bool is_round(const btConvexShape& shape) { return InnerShape(shape).is_round(); }

  InnerShape a_, b_;
  int count_ = 0;                // of the points that the last search ended with
  btVector3 on_a_[3], on_b_[3];  // in the shapes' own frames
};

//! A share of the margins: by more than that no box or cylinder with sharp edges reaches beyond its rounded ones.
inline constexpr double most_rounded = 0.74;  // sqrt 3 - 1

//! The closest points of two solids with sharp edges, at their distance or penetration depth; none if they are farther
//! than `reach` from each other [m].
std::optional<ClosestPoints> sharp_closest(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                                           const btTransform& pose_b, double reach);

//! The closest points of a cylinder that stands along an axis of a box or of another cylinder, for which GJK takes many
//! iterations: a question of a circle and a rectangle, or of two circles. The points are half way up their common
//! height. Unset if the axes are not parallel, if one is above the other, or if the inner shapes penetrate each other.
std::optional<ClosestPoints> distance_side_by_side(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                                   const btTransform& pose_b);

}  // namespace energymargin

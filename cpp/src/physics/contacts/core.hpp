#pragma once
// A convex solid without its margin.

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <vector>

#include "physics/contacts/hull_shape.hpp"

namespace energymargin {

//! Bullet's box, sphere, capsule, cylinder or hull: what is left of it without its margin. The shape outlives this.
class Core {
 public:
  explicit Core(const btConvexShape& shape)
      : kind_(shape.getShapeType()),
        half_(static_cast<const btConvexInternalShape&>(shape).getImplicitShapeDimensions()),
        margin_(shape.getMarginNonVirtual()) {
    if (kind_ != CONVEX_HULL_SHAPE_PROXYTYPE) return;
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    if (const auto* whole = dynamic_cast<const HullShape*>(&shape)) corners_ = &whole->corners();
    points_ = hull.getUnscaledPoints();
    count_ = hull.getNumPoints();
  }

  int kind() const { return kind_; }

  //! Half of the size along each axis, of all but hulls.
  const btVector3& half() const { return half_; }

  //! What lies around it [m]: of a sphere or a capsule its radius.
  double margin() const { return margin_; }

  //! The corners of a HullShape with its margin.
  const std::vector<btVector3>& corners() const { return *corners_; }

  //! Its farthest point along a direction, both in its own frame.
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
        return farthest_corner(direction);
      default:  // sphere
        return {0.0, 0.0, 0.0};
    }
  }

 private:
  const btVector3& farthest_corner(const btVector3& direction) const {
    const btVector3* best = points_;
    double most = direction.dot(*best);
    for (const btVector3* point = points_ + 1; point != points_ + count_; ++point) {
      const double along = direction.dot(*point);
      if (along <= most) continue;
      most = along;
      best = point;
    }
    return *best;
  }

  int kind_;
  btVector3 half_;
  double margin_;
  const std::vector<btVector3>* corners_ = nullptr;  // of a HullShape
  const btVector3* points_ = nullptr;
  int count_ = 0;
};

//! Cores nearer than this overlap, as far as one can tell: the direction between them is not known [m]. It is a small
//! share of their margins, so that what small solids do is what large ones do.
inline double clearly_apart(const Core& a, const Core& b) {
  constexpr double most = 1e-5, share = 1e-3;
  return std::min(most, share * (a.margin() + b.margin()));
}

}  // namespace energymargin

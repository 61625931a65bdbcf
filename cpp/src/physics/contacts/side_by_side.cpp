#include <algorithm>
#include <cmath>

#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

// Axes are parallel up to this angle [rad]: what a tilted cylinder is more than a circle is then a ten-thousandth of
// it.
constexpr double tilt = 0.01;

// The points are at an end of the common height where that is so much closer than the other [m], and between them
// before. Of cylinders that cross, they are at the lowest point of a parabola through both ends and the middle.
constexpr double clearly_closer = 1e-5;

// The nearest point of a box or a cylinder to one beside it, across `axis`, in its own frame.
btVector3 nearest_across(const InnerShape& shape, int axis, btVector3 point) {
  point[axis] = 0.0;
  const btVector3& half = shape.half();
  if (shape.is_cylinder()) return point * (half.x() / point.length());
  for (int i = 0; i < 3; ++i) point[i] = std::clamp(point[i], -half[i], half[i]);
  return point;
}

// `a` is a cylinder, `b` a box or a cylinder; in the frame of b.
struct Beside {
  const InnerShape &a, &b;
  btVector3 center, along;  // of a, and its axis
  int axis;                 // of b, that is parallel

  btVector3 on_axis(double height) const { return center + along * ((height - center[axis]) / along[axis]); }

  btVector3 on_b(const btVector3& beside) const {
    btVector3 point = nearest_across(b, axis, beside);
    point[axis] = beside[axis];
    return point;
  }

  double distance(double height) const {
    const btVector3 point = on_axis(height);
    return (point - on_b(point)).length() - a.half().x();
  }

  bool is_inside(const btVector3& point) const {
    const double radius = b.half().x();
    return b.is_cylinder() && point.x() * point.x() + point.y() * point.y() <= radius * radius;
  }
};

std::optional<ClosestPoints> beside(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                    const btTransform& pose_b) {
  const btVector3 along = pose_a.getBasis().getColumn(2) * pose_b.getBasis();
  const int axis = b.is_cylinder() ? 2 : along.absolute().maxAxis();
  if (1.0 - std::abs(along[axis]) > 0.5 * tilt * tilt) return std::nullopt;
  const Beside pair{a, b, (pose_a.getOrigin() - pose_b.getOrigin()) * pose_b.getBasis(), along, axis};
  const double low = std::max(pair.center[axis] - a.half().z(), -b.half()[axis]);
  const double high = std::min(pair.center[axis] + a.half().z(), b.half()[axis]);
  if (low >= high) return std::nullopt;
  const double at_low = pair.distance(low), at_high = pair.distance(high);
  const double bend = 2.0 * (at_low + at_high - 2.0 * pair.distance(0.5 * (low + high)));
  const double share = 0.5 + 0.5 * std::clamp((at_low - at_high) / std::max(bend, clearly_closer), -1.0, 1.0);
  const btVector3 on_axis = pair.on_axis(low + share * (high - low));
  const btVector3 on_b = pair.on_b(on_axis);
  btVector3 away = on_axis - on_b;
  const double distance = away.length() - a.half().x();
  if (pair.is_inside(on_axis) || !(distance >= clearly_apart(a, b))) return std::nullopt;
  return ClosestPoints{pose_b.getBasis() * away.normalized(), pose_b(on_b), distance};
}

}  // namespace

std::optional<ClosestPoints> distance_side_by_side(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                                   const btTransform& pose_b) {
  if (a.is_cylinder() && (b.is_cylinder() || b.is_box())) return beside(a, pose_a, b, pose_b);
  if (!a.is_box() || !b.is_cylinder()) return std::nullopt;
  std::optional<ClosestPoints> swapped = beside(b, pose_b, a, pose_a);
  if (swapped) {
    swapped->normal = -swapped->normal;
    swapped->on_b -= swapped->normal * swapped->distance;
  }
  return swapped;
}

}  // namespace energymargin

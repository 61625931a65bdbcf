#include "physics/contacts/side_by_side.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// Axes are parallel up to this angle [rad]. The ends of what they share of their height are then closer than its middle
// by half of its length times this.
constexpr double tilt = 1e-3;

bool is_cylinder(const Core& core) { return core.kind() == CYLINDER_SHAPE_PROXYTYPE; }
bool is_box(const Core& core) { return core.kind() == BOX_SHAPE_PROXYTYPE; }

// The nearest point of a box or a cylinder to one beside it, across `axis`, in its own frame.
btVector3 nearest_across(const Core& core, int axis, btVector3 point) {
  point[axis] = 0.0;
  const btVector3& half = core.half();
  if (is_cylinder(core)) return point * (half.x() / point.length());
  for (int i = 0; i < 3; ++i) point[i] = std::clamp(point[i], -half[i], half[i]);
  return point;
}

// `a` is a cylinder, `b` a box or a cylinder.
std::optional<CoreDistance> beside(const Core& a, const btTransform& pose_a, const Core& b, const btTransform& pose_b) {
  const btVector3 along = pose_a.getBasis().getColumn(2) * pose_b.getBasis();
  const int axis = is_cylinder(b) ? 2 : along.absolute().maxAxis();
  if (1.0 - std::abs(along[axis]) > 0.5 * tilt * tilt) return std::nullopt;
  const btVector3 center = (pose_a.getOrigin() - pose_b.getOrigin()) * pose_b.getBasis();
  const double low = std::max(center[axis] - a.half().z(), -b.half()[axis]);
  const double high = std::min(center[axis] + a.half().z(), b.half()[axis]);
  if (low >= high) return std::nullopt;
  const double height = 0.5 * (low + high);
  const btVector3 on_axis = center + along * ((height - center[axis]) / along[axis]);
  btVector3 on_b = nearest_across(b, axis, on_axis);
  on_b[axis] = height;
  const btVector3 away = on_axis - on_b;
  const double distance = away.length() - a.half().x();
  const bool beyond = !is_cylinder(b) || btVector3(on_axis.x(), on_axis.y(), 0.0).length() > b.half().x();
  if (!beyond || distance < clearly_apart) return std::nullopt;
  return CoreDistance{pose_b.getBasis() * away.normalized(), pose_b(on_b), distance};
}

}  // namespace

std::optional<CoreDistance> distance_side_by_side(const Core& a, const btTransform& pose_a, const Core& b,
                                                  const btTransform& pose_b) {
  if (is_cylinder(a) && (is_cylinder(b) || is_box(b))) return beside(a, pose_a, b, pose_b);
  if (!is_box(a) || !is_cylinder(b)) return std::nullopt;
  std::optional<CoreDistance> swapped = beside(b, pose_b, a, pose_a);
  if (swapped) {
    swapped->normal = -swapped->normal;
    swapped->on_b -= swapped->normal * swapped->distance;
  }
  return swapped;
}

}  // namespace energymargin

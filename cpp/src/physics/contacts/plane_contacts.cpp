#include "physics/contacts/plane_contacts.hpp"

#include <cmath>

#include "physics/contacts/rims.hpp"

namespace energymargin {
namespace {

// A cylinder stands upright if its axis is as near to the vertical: square of the sine.
constexpr double upright = 1e-6;

// Of heights above a plane, a share of the coordinates that they come from: more than there is.
constexpr double rounding_of_heights = 1e-12;

// Calls `visit` with every point of a solid that can be its lowest one along `down`, all in its own frame; of a hull
// with those that can be within `depth` of it [m].
template <typename Visit>
void for_each_low_point(const InnerShape& solid, const btVector3& down, double depth, const Visit& visit) {
  const auto ends = [&](const btVector3& half, const btVector3& side) {
    visit(side + half);
    visit(side - half);
  };
  switch (solid.kind()) {
    case CYLINDER_SHAPE_PROXYTYPE: {
      // On each rim the lowest point, however little it is lower, and those eighths of a turn from it: a stand that
      // tips where its circle does, and a smooth roll.
      const btVector3 half = solid.half() + btVector3(solid.margin(), solid.margin(), solid.margin());
      for (const double z : {half.z(), -half.z()}) outlines::for_each_rim_corner(half.x(), z, down, visit);
      return;
    }
    case CAPSULE_SHAPE_PROXYTYPE:
      return ends(btVector3(0.0, 0.0, solid.half().z()), down * solid.margin());
    case SPHERE_SHAPE_PROXYTYPE:
      return visit(down * solid.margin());
    default:
      solid.for_each_corner_near(down, depth, visit);
  }
}

// Whether a solid is a cylinder on its round face.
bool stands(const InnerShape& solid, const btVector3& down) {
  return solid.is_cylinder() && down.x() * down.x() + down.y() * down.y() <= upright;
}

}  // namespace

void find_plane_contacts(const InnerShape& solid, const btTransform& pose, const WorldPlane& plane, double reach,
                         std::vector<FacePoint>& points) {
  points.clear();
  const btVector3 down = -plane.normal * pose.getBasis();
  const bool rubs_inside = stands(solid, down);
  double middle = 0.0, depth = BT_LARGE_FLOAT;
  if (solid.is_hull()) {  // its frame may be anywhere
    const auto [top, low] = solid.extent(down);
    const double height = plane.normal.dot(pose.getOrigin()) - plane.offset - low;
    middle = 0.5 * (top + low);
    depth = reach - height + rounding_of_heights * (std::abs(plane.offset) + pose.getOrigin().length() + std::abs(low));
    if (depth < 0.0) return;
  }
  for_each_low_point(solid, down, depth, [&](const btVector3& point) {
    if (down.dot(point) < middle) return;  // the top of a thin body is in reach too, and must not carry it
    const btVector3 on_solid = pose * point;
    const double distance = plane.normal.dot(on_solid) - plane.offset;
    if (distance >= reach) return;
    const btVector3 on_plane = on_solid - plane.normal * distance;
    points.push_back({on_plane, on_plane, distance});
    if (!rubs_inside) return;
    const btVector3 grip = pose * btVector3(grip_share * point.x(), grip_share * point.y(), point.z());
    points.back().grip = grip - plane.normal * distance;
  });
}

}  // namespace energymargin

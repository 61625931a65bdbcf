#include "physics/contacts/plane_contacts.hpp"

#include <algorithm>

namespace energymargin {
namespace {

// A cylinder stands upright if its axis is as near to the vertical: square of the sine. Then its points stay where they
// are, and its lowest one is a thousandth of the radius below them at most.
constexpr double upright = 1e-6;

// Calls `visit` with every point of a solid, in its own frame, that can be its lowest one. `down` is a direction in
// that frame.
template <typename Visit>
void for_each_low_point(const InnerShape& solid, const btVector3& down, const Visit& visit) {
  const auto ends = [&](const btVector3& half, const btVector3& side) {
    visit(side + half);
    visit(side - half);
  };
  switch (solid.kind()) {
    case CYLINDER_SHAPE_PROXYTYPE: {
      // On each rim the lowest point and those a quarter and half a turn from it: a firm stand, and a smooth roll.
      const btVector3 half = solid.half() + btVector3(solid.margin(), solid.margin(), solid.margin());
      btVector3 low(down.x(), down.y(), 0.0);
      low = low.length2() > upright ? low.normalized() * half.x() : btVector3(half.x(), 0.0, 0.0);
      const btVector3 across(-low.y(), low.x(), 0.0);
      for (const btVector3& side : {low, -low, across, -across}) ends(btVector3(0.0, 0.0, half.z()), side);
      return;
    }
    case CAPSULE_SHAPE_PROXYTYPE:
      return ends(btVector3(0.0, 0.0, solid.half().z()), down * solid.margin());
    case SPHERE_SHAPE_PROXYTYPE:
      return visit(down * solid.margin());
    default:
      solid.for_each_corner(visit);
  }
}

// Half way from a solid's top to its lowest point, along `down`. A hull may have its frame anywhere.
double half_way(const InnerShape& solid, const btVector3& down) {
  if (!solid.is_hull()) return 0.0;
  double top = BT_LARGE_FLOAT;
  double low = -BT_LARGE_FLOAT;
  solid.for_each_corner([&](const btVector3& point) {
    top = std::min(top, down.dot(point));
    low = std::max(low, down.dot(point));
  });
  return 0.5 * (top + low);
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
  const double middle = half_way(solid, down);
  for_each_low_point(solid, down, [&](const btVector3& point) {
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

#pragma once
// Contacts of a solid with a plane.

#include <vector>

#include "physics/contacts/face_contacts.hpp"

namespace energymargin {

//! Where a plane is in the world: normal . x = offset.
struct WorldPlane {
  btVector3 normal;
  double offset;  // [m]

  WorldPlane(const btStaticPlaneShape& plane, const btTransform& pose)
      : normal(pose.getBasis() * plane.getPlaneNormal()),
        offset(plane.getPlaneConstant() + normal.dot(pose.getOrigin())) {}
};

//! The closest point of a solid, seen with sharp edges, to a plane, on the plane.
inline ClosestPoints closest_to_plane(const InnerShape& solid, const btTransform& pose, const WorldPlane& plane) {
  const btVector3 down = -plane.normal;
  const btVector3 lowest = pose(solid.support(down * pose.getBasis())) + down * solid.margin();
  const double distance = plane.normal.dot(lowest) - plane.offset;
  return {plane.normal, lowest + down * distance, distance};
}

//! Sets `points` to all points of a solid within `reach` of a plane [m], at once: a body that slides fast would lose
//! those that Bullet gathers over several steps, sink and tilt.
void find_plane_contacts(const InnerShape& solid, const btTransform& pose, const WorldPlane& plane, double reach,
                         std::vector<FacePoint>& points);

}  // namespace energymargin

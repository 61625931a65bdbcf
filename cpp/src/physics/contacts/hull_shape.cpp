#include "physics/contacts/hull_shape.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>

namespace energymargin {
namespace {

// A corner is as far from the core as this many margins at most: a cube's is at 1.7 of them.
constexpr double most_margins = 2.0;

}  // namespace

HullShape::HullShape(const std::vector<Vector3>& points, double margin) {
  btConvexHullComputer core;
  const double shrunk =
      core.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), margin, 0.5);
  for (int i = 0; i < core.vertices.size(); ++i) addPoint(core.vertices[i], false);
  recalcLocalAabb();
  setMargin(shrunk);
  btConvexHullComputer whole;
  whole.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), 0.0, 0.0);
  low_ = high_ = core.vertices[0];
  for (int i = 0; i < whole.vertices.size(); ++i) {
    const Vector3& point = points[static_cast<std::size_t>(whole.original_vertex_index[i])];
    btVector3 corner(point.x(), point.y(), point.z());
    const btVector3* const near =
        std::min_element(getUnscaledPoints(), getUnscaledPoints() + getNumPoints(),
                         [&](const btVector3& a, const btVector3& b) { return corner.distance2(a) < corner.distance2(b); });
    const double away = corner.distance(*near);
    if (away > most_margins * shrunk) corner = *near + (corner - *near) * (most_margins * shrunk / away);
    corners_.push_back(corner);
    low_.setMin(corner);
    high_.setMax(corner);
  }
}

btVector3 HullShape::localGetSupportingVertex(const btVector3& direction) const {
  return *std::max_element(corners_.begin(), corners_.end(), [&](const btVector3& a, const btVector3& b) {
    return direction.dot(a) < direction.dot(b);
  });
}

void HullShape::getAabb(const btTransform& pose, btVector3& low, btVector3& high) const {
  btTransformAabb(low_, high_, 0.0, pose, low, high);
}

}  // namespace energymargin

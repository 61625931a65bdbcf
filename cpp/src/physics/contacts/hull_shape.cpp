#include "physics/contacts/hull_shape.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>

namespace energymargin {

namespace {

// Of a sliver less than was asked for can be taken off, or nothing.
constexpr int most_halvings = 8;

double shrink(const std::vector<Vector3>& points, double margin, btConvexHullComputer& inner) {
  const auto compute = [&](double asked) {
    return inner.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), asked, 0.5);
  };
  for (int i = 0; i < most_halvings; ++i, margin *= 0.5) {
    const double shrunk = compute(margin);
    if (shrunk >= 0.0 && inner.vertices.size() > 0) return shrunk;
  }
  return compute(0.0);
}

}  // namespace

HullShape::HullShape(const std::vector<Vector3>& points, double margin) {
  btConvexHullComputer inner;
  const double shrunk = shrink(points, margin, inner);
  for (int i = 0; i < inner.vertices.size(); ++i) addPoint(inner.vertices[i], false);
  recalcLocalAabb();
  setMargin(shrunk);
  btConvexHullComputer whole;
  whole.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), 0.0, 0.0);
  for (int i = 0; i < whole.vertices.size(); ++i) {
    const Vector3& point = points[static_cast<std::size_t>(whole.original_vertex_index[i])];
    corners_.emplace_back(point.x(), point.y(), point.z());
  }
  low_ = high_ = corners_.front();
  for (const btVector3& corner : corners_) {
    low_.setMin(corner);
    high_.setMax(corner);
  }
}

btVector3 HullShape::localGetSupportingVertex(const btVector3& direction) const {
  return *std::max_element(corners_.begin(), corners_.end(),
                           [&](const btVector3& a, const btVector3& b) { return direction.dot(a) < direction.dot(b); });
}

void HullShape::getAabb(const btTransform& pose, btVector3& low, btVector3& high) const {
  btTransformAabb(low_, high_, 0.0, pose, low, high);
}

}  // namespace energymargin

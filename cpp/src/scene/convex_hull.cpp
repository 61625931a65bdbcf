// The solid of points.

#include <cmath>
#include <limits>

#include "scene/hull_faces.hpp"
#include "scene/solids.hpp"

namespace energymargin {
namespace {

// Sums over tetrahedra between the origin and each triangle of the surface.
struct Moments {
  double volume = 0.0;
  Vector3 first = Vector3::Zero();                   // integral of x
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // integral of x x^T

  void add(const Vector3& a, const Vector3& b, const Vector3& c) {
    const double six_volumes = a.dot(b.cross(c));
    const Vector3 sum = a + b + c;
    volume += six_volumes / 6.0;
    first += six_volumes / 24.0 * sum;
    second += six_volumes / 120.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
};

Moments moments(const std::vector<Vector3>& points) {
  Moments total;
  for (const auto& [a, b, c] : hull_faces(points)) total.add(points[a], points[b], points[c]);
  if (total.volume < 0.0) {
    total.volume = -total.volume;
    total.first = -total.first;
    total.second = -total.second;
  }
  return total;
}

}  // namespace

void validate(const ConvexHull& hull) {
  if (hull.points.size() < 4) reject("points", std::to_string(hull.points.size()) + " points", "at least 4");
  for (const Vector3& point : hull.points) require_finite("points", point);
  if (!(mass_properties(hull, 1.0).volume > 0.0)) {
    reject("points", "a flat set of points", "points that span a volume");
  }
}

// Along the principal axes: exact for a brick, close for the rest.
double smallest_half_extent(const ConvexHull& hull) {
  const Quaternion to_axes = mass_properties(hull, 1.0).axes.conjugate();
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const Vector3& point : hull.points) {
    low = low.cwiseMin(to_axes * point);
    high = high.cwiseMax(to_axes * point);
  }
  return 0.5 * (high - low).minCoeff();
}

double reach_from(const ConvexHull& hull, const Vector3& point) {
  double most = 0.0;
  for (const Vector3& corner : hull.points) most = std::max(most, (corner - point).norm());
  return most;
}

MassProperties mass_properties(const ConvexHull& hull, double mass) {
  const Moments total = moments(hull.points);
  const double size = total.second.norm();
  if (!(total.volume > 1e-12 * std::pow(size, 0.6))) return {};
  const double density = mass / total.volume;
  const Vector3 centre = total.first / total.volume;
  const Eigen::Matrix3d second = density * total.second - mass * centre * centre.transpose();
  return principal(total.volume, centre, second.trace() * Eigen::Matrix3d::Identity() - second);
}

ConvexHull centered(const ConvexHull& hull) {
  validate(hull);
  const Vector3 center = mass_properties(hull, 1.0).center;
  ConvexHull moved = hull;
  for (Vector3& point : moved.points) point -= center;
  return moved;
}

}  // namespace energymargin

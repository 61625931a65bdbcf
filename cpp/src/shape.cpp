#include "energymargin/shape.hpp"

#include <algorithm>
#include <limits>

#include "check.hpp"

namespace energymargin {
namespace {

struct Validator {
  void operator()(const Plane& plane) const {
    require_finite("normal", plane.normal);
    require_unit("normal", plane.normal);
    require_finite("offset", plane.offset);
  }
  void operator()(const Box& box) const {
    if (!(box.size.allFinite() && (box.size.array() > 0.0).all())) {
      reject("size", text(box.size), "three finite numbers above 0");
    }
  }
  void operator()(const Sphere& sphere) const { require_positive("radius", sphere.radius); }
  void operator()(const Cylinder& cylinder) const {
    require_positive("radius", cylinder.radius);
    require_positive("length", cylinder.length);
  }
  void operator()(const Capsule& capsule) const {
    require_positive("radius", capsule.radius);
    require_positive("length", capsule.length);
  }
  void operator()(const ConvexHull& hull) const {
    if (hull.points.size() < 4) reject("points", std::to_string(hull.points.size()) + " points", "at least 4");
    for (const Vector3& point : hull.points) require_finite("points", point);
    if (!(mass_properties(hull, 1.0).volume > 0.0)) {
      reject("points", "a flat set of points", "points that span a volume");
    }
  }
};

struct SmallestHalfExtent {
  double operator()(const Plane&) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const Box& box) const { return 0.5 * box.size.minCoeff(); }
  double operator()(const Sphere& sphere) const { return sphere.radius; }
  double operator()(const Cylinder& cylinder) const { return std::min(cylinder.radius, 0.5 * cylinder.length); }
  double operator()(const Capsule& capsule) const { return capsule.radius; }
  double operator()(const ConvexHull& hull) const {
    // Along the principal axes: exact for a brick, close for the rest.
    const Quaternion to_axes = mass_properties(hull, 1.0).axes.conjugate();
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    for (const Vector3& point : hull.points) {
      low = low.cwiseMin(to_axes * point);
      high = high.cwiseMax(to_axes * point);
    }
    return 0.5 * (high - low).minCoeff();
  }
};

}  // namespace

void validate(const Shape& shape) { std::visit(Validator{}, shape); }

double smallest_half_extent(const Shape& shape) { return std::visit(SmallestHalfExtent{}, shape); }

ConvexHull centered(const ConvexHull& hull) {
  validate(hull);
  const Vector3 centre = mass_properties(hull, 1.0).centre;
  ConvexHull moved = hull;
  for (Vector3& point : moved.points) point -= centre;
  return moved;
}

}  // namespace energymargin

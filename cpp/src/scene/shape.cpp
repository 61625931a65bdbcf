#include "energymargin/shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.hpp"

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
  void operator()(const Compound& compound) const {
    for (std::size_t i = 0; i < compound.parts.size(); ++i) {
      const Part& part = compound.parts[i];
      try {
        std::visit(*this, part.shape);
        require_finite("position", part.pose.position);
        require_unit("orientation", part.pose.orientation);
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("parts[" + std::to_string(i) + "]: " + error.what());
      }
    }
    if (!compound.solid) return;
    require_positive("solid: volume", compound.solid->volume);
    require_finite("solid: center", compound.solid->center);
    require_unit("solid: axes", compound.solid->axes);
    validate_moments("solid: moments", compound.solid->moments);
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
  // The most solid part: a decomposed mesh has slivers, which say nothing of how deep is deep.
  double operator()(const Compound& compound) const {
    double most = compound.parts.empty() ? std::numeric_limits<double>::infinity() : 0.0;
    for (const Part& part : compound.parts) most = std::max(most, std::visit(*this, part.shape));
    return most;
  }
};

struct Reach {
  Vector3 point;

  double operator()(const Plane&) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const Box& box) const { return (point.cwiseAbs() + 0.5 * box.size).norm(); }
  double operator()(const Sphere& sphere) const { return point.norm() + sphere.radius; }
  double operator()(const Cylinder& cylinder) const {
    return std::hypot(point.head<2>().norm() + cylinder.radius, std::abs(point.z()) + 0.5 * cylinder.length);
  }
  double operator()(const Capsule& capsule) const {
    return std::hypot(point.head<2>().norm(), std::abs(point.z()) + 0.5 * capsule.length) + capsule.radius;
  }
  double operator()(const ConvexHull& hull) const {
    double most = 0.0;
    for (const Vector3& corner : hull.points) most = std::max(most, (corner - point).norm());
    return most;
  }
  double operator()(const Compound& compound) const {
    double most = 0.0;
    for (const auto& [shape, pose] : compound.parts) {
      most = std::max(most, std::visit(Reach{pose.orientation.conjugate() * (point - pose.position)}, shape));
    }
    return most;
  }
};

}  // namespace

void validate(const Shape& shape) { std::visit(Validator{}, shape); }

void validate_moments(const std::string& name, const Vector3& moments) {
  const bool positive = moments.allFinite() && (moments.array() > 0.0).all();
  // No two moments are less than the third; rounding in files gets a little room.
  if (!(positive && 2.0 * moments.maxCoeff() <= moments.sum() * (1.0 + 1e-6))) {
    reject(name, text(moments), "three numbers above 0 of which none is greater than the sum of the others");
  }
}

double reach_from(const Shape& shape, const Vector3& point) { return std::visit(Reach{point}, shape); }

double smallest_half_extent(const Shape& shape) { return std::visit(SmallestHalfExtent{}, shape); }

ConvexHull centered(const ConvexHull& hull) {
  validate(hull);
  const Vector3 center = mass_properties(hull, 1.0).center;
  ConvexHull moved = hull;
  for (Vector3& point : moved.points) point -= center;
  return moved;
}

}  // namespace energymargin

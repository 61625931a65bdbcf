#pragma once
// The solids, one after the other: the fields of each, what it may be, how far it reaches, and its mass properties.
// Bullet's shapes for them are in physics/shapes.cpp.

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "base/record.hpp"
#include "energymargin/shape.hpp"

namespace energymargin {

//! Mass properties from the inertia about the centre, along the axes of the shape's frame [kg m^2].
inline MassProperties principal(double volume, const Vector3& center, const Eigen::Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  return {volume, center, solver.eigenvalues(), Quaternion(axes).normalized()};
}

//! Mass properties of a solid that is round about its z axis: `across` and `along` are its principal moments [kg m^2].
inline MassProperties about_axis(double volume, double across, double along) {
  return {volume, Vector3::Zero(), {across, across, along}, Quaternion::Identity()};
}

template <>
struct Record<Box> {
  static constexpr const char* name = "box";
  static constexpr const char* type = "box";
  static constexpr const char* description = "A box along the axes of its frame, about its origin.";
  static auto fields() {
    return std::tuple{Field{"size", &Box::size, "Full edge lengths along x, y, z [m].", forms::positive_list}};
  }
};

inline void validate(const Box& box) {
  if (!(box.size.allFinite() && (box.size.array() > 0.0).all())) {
    reject("size", text(box.size), "three finite numbers above 0");
  }
}
inline double smallest_half_extent(const Box& box) { return 0.5 * box.size.minCoeff(); }
inline double reach_from(const Box& box, const Vector3& point) { return (point.cwiseAbs() + 0.5 * box.size).norm(); }
inline MassProperties mass_properties(const Box& box, double mass) {
  const Vector3 squares = box.size.cwiseAbs2();
  return {box.size.prod(), Vector3::Zero(), mass / 12.0 * (Vector3::Constant(squares.sum()) - squares),
          Quaternion::Identity()};
}

template <>
struct Record<Sphere> {
  static constexpr const char* name = "sphere";
  static constexpr const char* type = "sphere";
  static constexpr const char* description = "A sphere about the origin of its frame.";
  static auto fields() { return std::tuple{Field{"radius", &Sphere::radius, "[m]", forms::positive}}; }
};

inline void validate(const Sphere& sphere) { require_positive("radius", sphere.radius); }
inline double smallest_half_extent(const Sphere& sphere) { return sphere.radius; }
inline double reach_from(const Sphere& sphere, const Vector3& point) { return point.norm() + sphere.radius; }
inline MassProperties mass_properties(const Sphere& sphere, double mass) {
  const double r = sphere.radius;
  return about_axis(4.0 / 3.0 * pi * r * r * r, 0.4 * mass * r * r, 0.4 * mass * r * r);
}

template <>
struct Record<Cylinder> {
  static constexpr const char* name = "cylinder";
  static constexpr const char* type = "cylinder";
  static constexpr const char* description = "A cylinder about its own z axis.";
  static auto fields() {
    return std::tuple{
        Field{"radius", &Cylinder::radius, "[m]", forms::positive},
        Field{"length", &Cylinder::length, "Along z [m].", forms::positive},
    };
  }
};

inline void validate(const Cylinder& cylinder) {
  require_positive("radius", cylinder.radius);
  require_positive("length", cylinder.length);
}
inline double smallest_half_extent(const Cylinder& cylinder) {
  return std::min(cylinder.radius, 0.5 * cylinder.length);
}
inline double reach_from(const Cylinder& cylinder, const Vector3& point) {
  return std::hypot(point.head<2>().norm() + cylinder.radius, std::abs(point.z()) + 0.5 * cylinder.length);
}
inline MassProperties mass_properties(const Cylinder& cylinder, double mass) {
  const double r = cylinder.radius;
  const double h = cylinder.length;
  return about_axis(pi * r * r * h, mass * (3.0 * r * r + h * h) / 12.0, 0.5 * mass * r * r);
}

template <>
struct Record<Capsule> {
  static constexpr const char* name = "capsule";
  static constexpr const char* type = "capsule";
  static constexpr const char* description = "A capsule about its own z axis.";
  static auto fields() {
    return std::tuple{
        Field{"radius", &Capsule::radius, "[m]", forms::positive},
        Field{"length", &Capsule::length, "Of the cylindrical part, along z [m].", forms::positive},
    };
  }
};

inline void validate(const Capsule& capsule) {
  require_positive("radius", capsule.radius);
  require_positive("length", capsule.length);
}
inline double smallest_half_extent(const Capsule& capsule) { return capsule.radius; }
inline double reach_from(const Capsule& capsule, const Vector3& point) {
  return std::hypot(point.head<2>().norm(), std::abs(point.z()) + 0.5 * capsule.length) + capsule.radius;
}
inline MassProperties mass_properties(const Capsule& capsule, double mass) {
  const double r = capsule.radius;
  const double h = capsule.length;
  const double tube = pi * r * r * h;
  const double ball = 4.0 / 3.0 * pi * r * r * r;
  const double tube_mass = mass * tube / (tube + ball);
  const double ball_mass = mass - tube_mass;
  // Each half ball: its own inertia about its centre of mass, 3/8 r from the flat side, moved to the middle.
  const double across =
      tube_mass * (3.0 * r * r + h * h) / 12.0 + ball_mass * (0.4 * r * r + 0.25 * h * h + 0.375 * h * r);
  return about_axis(tube + ball, across, 0.5 * tube_mass * r * r + 0.4 * ball_mass * r * r);
}

template <>
struct Record<ConvexHull> {
  static constexpr const char* name = "convex_hull";
  static constexpr const char* type = "convex_hull";
  static constexpr const char* description = "The convex hull of points in the body's frame.";
  static auto fields() {
    return std::tuple{
        Field{"points", &ConvexHull::points, "In the shape's frame [m]; they span a volume.", forms::points}};
  }
};

void validate(const ConvexHull& hull);
double smallest_half_extent(const ConvexHull& hull);
double reach_from(const ConvexHull& hull, const Vector3& point);
MassProperties mass_properties(const ConvexHull& hull, double mass);

}  // namespace energymargin

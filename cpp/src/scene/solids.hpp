#pragma once
// The solids, one after the other: the fields of each, what it may be, how far it reaches, and its mass properties.
// Bullet's shapes for them are in physics/shapes.cpp.

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "base/record.hpp"
#include "energymargin/shape.hpp"

namespace energymargin {

//! Of a solid that is round about its z axis: `across` and `along` are its principal moments [kg m^2].
inline MassProperties about_axis(double volume, double across, double along) {
  return {volume, Vector3::Zero(), {across, across, along}, Quaternion::Identity()};
}

//! What shape.hpp asks of every shape. `mass` is in kg, `point` in the solid's frame.
template <typename Shape>
struct Geometry;

template <>
struct Record<Box> {
  static constexpr const char* name = "box";
  static constexpr const char* type = "box";
  static constexpr const char* description = "A box along the axes of its frame, about its origin.";
  static auto fields() {
    return std::tuple{Field{"size", &Box::size, "Full edge lengths along x, y, z [m].", forms::positive_list}};
  }
};

template <>
struct Geometry<Box> {
  static void validate(const Box& box) {
    if (!(box.size.allFinite() && (box.size.array() > 0.0).all())) {
      reject("size", text(box.size), "three finite numbers above 0");
    }
  }
  static double smallest_half_extent(const Box& box) { return 0.5 * box.size.minCoeff(); }
  static double reach_from(const Box& box, const Vector3& point) { return (point.cwiseAbs() + 0.5 * box.size).norm(); }
  static MassProperties mass_properties(const Box& box, double mass) {
    const Vector3 squares = box.size.cwiseAbs2();
    return {box.size.prod(), Vector3::Zero(), mass / 12.0 * (Vector3::Constant(squares.sum()) - squares),
            Quaternion::Identity()};
  }
};

template <>
struct Record<Sphere> {
  static constexpr const char* name = "sphere";
  static constexpr const char* type = "sphere";
  static constexpr const char* description = "A sphere about the origin of its frame.";
  static auto fields() { return std::tuple{Field{"radius", &Sphere::radius, "[m]", forms::positive}}; }
};

template <>
struct Geometry<Sphere> {
  static void validate(const Sphere& sphere) { require_positive("radius", sphere.radius); }
  static double smallest_half_extent(const Sphere& sphere) { return sphere.radius; }
  static double reach_from(const Sphere& sphere, const Vector3& point) { return point.norm() + sphere.radius; }
  static MassProperties mass_properties(const Sphere& sphere, double mass) {
    const double r = sphere.radius;
    return about_axis(4.0 / 3.0 * pi * r * r * r, 0.4 * mass * r * r, 0.4 * mass * r * r);
  }
};

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

template <>
struct Geometry<Cylinder> {
  static void validate(const Cylinder& cylinder) {
    require_positive("radius", cylinder.radius);
    require_positive("length", cylinder.length);
  }
  static double smallest_half_extent(const Cylinder& cylinder) {
    return std::min(cylinder.radius, 0.5 * cylinder.length);
  }
  static double reach_from(const Cylinder& cylinder, const Vector3& point) {
    return std::hypot(point.head<2>().norm() + cylinder.radius, std::abs(point.z()) + 0.5 * cylinder.length);
  }
  static MassProperties mass_properties(const Cylinder& cylinder, double mass) {
    const double r = cylinder.radius;
    const double h = cylinder.length;
    return about_axis(pi * r * r * h, mass * (3.0 * r * r + h * h) / 12.0, 0.5 * mass * r * r);
  }
};

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

template <>
struct Geometry<Capsule> {
  static void validate(const Capsule& capsule) {
    require_positive("radius", capsule.radius);
    require_positive("length", capsule.length);
  }
  static double smallest_half_extent(const Capsule& capsule) { return capsule.radius; }
  static double reach_from(const Capsule& capsule, const Vector3& point) {
    return std::hypot(point.head<2>().norm(), std::abs(point.z()) + 0.5 * capsule.length) + capsule.radius;
  }
  static MassProperties mass_properties(const Capsule& capsule, double mass) {
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
};

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

template <>
struct Geometry<ConvexHull> {
  static void validate(const ConvexHull& hull);
  static double smallest_half_extent(const ConvexHull& hull);
  static double reach_from(const ConvexHull& hull, const Vector3& point);
  static MassProperties mass_properties(const ConvexHull& hull, double mass);
};

}  // namespace energymargin

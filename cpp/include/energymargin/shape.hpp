#pragma once
// The shapes of bodies, as plain values, and the mass properties that follow from them.

#include <optional>
#include <variant>
#include <vector>

#include "energymargin/types.hpp"

namespace energymargin {

//! The half space below a plane: {x : normal . x <= offset}.
struct Plane {
  Vector3 normal = Vector3::UnitZ();  //!< unit vector, out of the solid
  double offset = 0.0;                //!< of the surface along the normal [m]
};

struct Box {
  Vector3 size = Vector3::Ones();  //!< full edge lengths [m]
};

struct Sphere {
  double radius = 0.5;  //!< [m]
};

//! A cylinder about its own z axis.
struct Cylinder {
  double radius = 0.5;  //!< [m]
  double length = 1.0;  //!< [m]
};

//! A capsule about its own z axis.
struct Capsule {
  double radius = 0.5;  //!< [m]
  double length = 1.0;  //!< of the cylindrical part [m]
};

//! The convex hull of points in the body's frame.
struct ConvexHull {
  std::vector<Vector3> points;  //!< [m]
};

//! Volume, centre of mass and inertia of a solid of even density.
struct MassProperties {
  double volume = 0.0;                       //!< [m^3]
  Vector3 center = Vector3::Zero();          //!< centre of mass in the shape's frame [m]
  Vector3 moments = Vector3::Zero();         //!< principal moments about the centre, of the given mass [kg m^2]
  Quaternion axes = Quaternion::Identity();  //!< turns the principal axes into the shape's
};

using Solid = std::variant<Box, Sphere, Cylinder, Capsule, ConvexHull>;

//! A solid at its place in a compound.
struct Part {
  Solid shape;
  Pose pose{};  //!< in the body's frame
};

//! Several solids that move as one; without parts there is nothing to collide with.
struct Compound {
  std::vector<Part> parts;
  //! Of a body of 1 kg, where the parts stand for another solid, as for a mesh; unset: those of the parts together.
  std::optional<MassProperties> solid{};
};

using Shape = std::variant<Plane, Box, Sphere, Cylinder, Capsule, ConvexHull, Compound>;

//! Throws std::invalid_argument on sizes, directions, poses and mass properties that cannot be.
void validate(const Shape& shape);

//! Mass properties of a solid `shape` of `mass` [kg]; all zero for a plane, for a mass of 0, and without parts.
MassProperties mass_properties(const Shape& shape, double mass);

//! The hull with its centre of mass moved to the origin.
ConvexHull centered(const ConvexHull& hull);

//! Half of the least extent, of a hull along its principal axes, of a compound that of its thickest part [m]; or inf.
double smallest_half_extent(const Shape& shape);

//! Distance of the farthest point from a point in the shape's frame, or a little more [m]; inf for a plane.
double reach_from(const Shape& shape, const Vector3& point);

}  // namespace energymargin

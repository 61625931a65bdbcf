#pragma once
// The shapes of bodies, as plain values, and the mass properties that follow from them.

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

//! The convex hull of points in the body's frame, whose origin is the hull's centre of mass.
struct ConvexHull {
  std::vector<Vector3> points;  //!< [m]
};

using Shape = std::variant<Plane, Box, Sphere, Cylinder, Capsule, ConvexHull>;

//! Throws std::invalid_argument unless the sizes are finite and positive and the normal is a unit vector.
void validate(const Shape& shape);

//! How a solid of even density resists to motion.
struct MassProperties {
  double volume = 0.0;                       //!< [m^3]
  Vector3 centre = Vector3::Zero();          //!< centre of mass in the shape's frame [m]
  Vector3 inertia = Vector3::Zero();         //!< principal moments about the centre [kg m^2]
  Quaternion axes = Quaternion::Identity();  //!< turns the principal axes into the shape's
};

//! Mass properties of a solid `shape` of `mass` [kg]; all zero for a plane or a mass of 0.
MassProperties mass_properties(const Shape& shape, double mass);

//! The hull with its centre of mass moved to the origin.
ConvexHull centered(const ConvexHull& hull);

//! Half of the least extent, for a hull along its principal axes [m]; inf for a plane.
double smallest_half_extent(const Shape& shape);

}  // namespace energymargin

#pragma once
// What follows from a body alone and takes long to find: the copies of a scene share it.

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"

namespace energymargin {

//! The solids of a shape, where they are in its frame; none of a plane.
std::vector<Part> solids_of(const Shape& shape);

//! The constants of one body of a scene. Any thread may ask for any of them.
class BodyConstants {
 public:
  //! The shape of the body is valid.
  explicit BodyConstants(const Body& body);

  //! These constants for another collision margin.
  BodyConstants(const BodyConstants& other) : inertial_(other.inertial_), half_extents_(other.half_extents_) {}

  const Inertial& inertial() const { return inertial_; }

  //! The smallest half extent of each solid of the shape, in the order of a compound's parts [m]; none of a plane.
  const std::vector<double>& half_extents() const { return half_extents_; }

  //! The smallest half extent of the shape [m]; of a compound that of its thickest part, since a decomposed mesh has
  //! slivers. Infinite of a plane.
  double smallest_half_extent() const;

  //! The collision shape of `body`, which is the one that these are the constants of. The first caller makes it, with
  //! its margin [m]; one scene has one margin.
  const CollisionShape& collision_shape(const Body& body, std::optional<double> margin) const;

 private:
  Inertial inertial_;
  std::vector<double> half_extents_;
  mutable std::once_flag shape_made_;
  mutable std::shared_ptr<const CollisionShape> collision_shape_;
};

//! The collision shape in a frame at the body's centre of mass, along its principal axes, as Bullet wants it. Its outer
//! surface is the true one: the margin lies inside and only rounds the edges. `margin` unset: a twentieth of the
//! smallest half extent of each part.
std::shared_ptr<const CollisionShape> make_collision_shape(const Body& body, const BodyConstants& constants,
                                                           std::optional<double> margin);

}  // namespace energymargin

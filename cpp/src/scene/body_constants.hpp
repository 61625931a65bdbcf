#pragma once
// What follows from a body alone and takes long to find: the copies of a scene share it.

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"

namespace energymargin {

//! Triangles of a convex hull's surface as indices of its points, counter-clockwise from outside. Bullet finds them.
std::vector<std::array<std::size_t, 3>> hull_faces(const std::vector<Vector3>& points);

//! Collision margin of a solid [m]: as asked for, up to half of its smallest half extent; else a twentieth of that.
//! Bullet's default of 4 cm would swallow a 10 cm box; a twentieth keeps GJK well conditioned at any scale.
inline double collision_margin(double smallest_half_extent, const std::optional<double>& asked) {
  constexpr double share = 0.05, most_share = 0.5;
  return asked ? std::min(*asked, most_share * smallest_half_extent) : share * smallest_half_extent;
}

//! How deep one solid may come into another where a surface gives way [m].
inline double compliant_penetration(double half_extent_a, double half_extent_b) {
  return 0.8 * std::min(half_extent_a, half_extent_b);
}

//! How deep the simulation lets one solid move into another [m]; `margins` is the sum of both.
inline double allowed_penetration(double margins, double half_extent_a, double half_extent_b) {
  constexpr double share_of_margins = 0.7, share_of_thickness = 0.3;  // of the thinner one's half extent
  return std::min(share_of_margins * margins, share_of_thickness * std::min(half_extent_a, half_extent_b));
}

//! So many times deeper they may be pressed: by less than their margins.
constexpr double pressed_deeper = 1.35;

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

  //! The smallest half extent of the shape, of a compound that of its thickest part [m]; inf for a plane.
  double smallest_half_extent() const;

  //! The collision shape of `body`, whose constants these are. The first caller makes it, with the scene's margin [m].
  const CollisionShape& collision_shape(const Body& body, std::optional<double> margin) const;

 private:
  Inertial inertial_;
  std::vector<double> half_extents_;
  mutable std::once_flag shape_made_;
  mutable std::shared_ptr<const CollisionShape> collision_shape_;
};

//! The collision shape in a frame at the body's centre of mass, along its principal axes. The margin lies inside and
//! only rounds the edges; unset: a twentieth of the smallest half extent of each part.
std::shared_ptr<const CollisionShape> make_collision_shape(const Body& body, const BodyConstants& constants,
                                                           std::optional<double> margin);

}  // namespace energymargin

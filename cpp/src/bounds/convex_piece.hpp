#pragma once
// A convex piece of a body as the contacts see it, with its edges rounded by the collision margin: how deep a point is.

#include <limits>
#include <optional>
#include <vector>

#include "energymargin/shape.hpp"
#include "energymargin/types.hpp"

namespace energymargin::bounds {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

//! A solid at its place. A ball of radius `depth(p)` about p lies inside of it: so says every positive depth.
class ConvexPiece {
 public:
  //! `margin` is the scene's [m]; unset: a twentieth of the smallest half extent.
  ConvexPiece(const Solid& solid, const Pose& pose, const std::optional<double>& margin = std::nullopt);

  //! Distance from a point inside to the surface; outside minus the distance, or a little less [m].
  double depth(const Vector3& point) const;

  //! A point of the piece that is near a point, the nearest one of all but hulls.
  Vector3 near(const Vector3& point) const;

  //! The farthest point of the solid, its edges sharp, in a direction.
  Vector3 support(const Vector3& direction) const;

  const Vector3& center() const { return pose_.position; }          //!< a point inside
  double radius() const { return radius_; }                         //!< of a ball about the centre that holds it [m]
  double inner_radius() const { return depth(pose_.position); }     //!< of a ball about the centre inside of it [m]
  double half_extent() const { return half_extent_; }               //!< the smallest [m]
  double margin() const { return margin_; }                         //!< all of the radius of what is round [m]
  const std::vector<Vector3>& corners() const { return corners_; }  //!< without the margin; none of what is round

  //! Whether anything is left without the margin: of a sliver of a hull there may be nothing.
  bool solid() const { return solid_; }

 private:
  struct Face {
    Vector3 normal;
    double offset;
  };

  double inner_depth(const Vector3& local) const;
  Vector3 inner_near(const Vector3& local) const;
  void set_faces(const ConvexHull& hull);

  Pose pose_;  // of its frame
  Quaternion inverse_;
  Solid shape_;
  double margin_ = 0.0, half_extent_ = 0.0, radius_ = 0.0;
  bool solid_ = true;
  Vector3 half_ =
      Vector3::Zero();       // of a box without its margin; of a cylinder: radius, radius, half length; of a capsule: z
  std::vector<Face> faces_;  // of a hull without its margin
  std::vector<Vector3> corners_;
};

//! The convex pieces of a shape at `pose`; none of a plane.
std::vector<ConvexPiece> convex_pieces(const Shape& shape, const Pose& pose, const std::optional<double>& margin);

}  // namespace energymargin::bounds

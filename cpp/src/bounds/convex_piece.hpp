#pragma once
// A convex piece of a body as continuous collision sees it, with its edges rounded by the collision margin: how deep a
// point is.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "energymargin/shape.hpp"
#include "energymargin/types.hpp"
#include "scene/body_constants.hpp"

namespace energymargin::bounds {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

//! A solid at its place. A ball of radius `depth(p)` about p lies inside of it: so says every positive depth.
class ConvexPiece {
 public:
  //! `margin` is the scene's [m]; unset: a twentieth of the smallest half extent.
  ConvexPiece(const Solid& solid, const Pose& pose, const std::optional<double>& margin = std::nullopt)
      : pose_(pose), shape_(solid) {
    half_extent_ = std::visit([](const auto& of) { return smallest_half_extent(of); }, solid);
    margin_ = collision_margin(half_extent_, margin);
    if (const auto* box = std::get_if<Box>(&solid)) {
      half_ = 0.5 * box->size - Vector3::Constant(margin_);
      corners_ = box_corners(half_);
    } else if (const auto* sphere = std::get_if<Sphere>(&solid)) {
      margin_ = sphere->radius;
    } else if (const auto* capsule = std::get_if<Capsule>(&solid)) {
      margin_ = capsule->radius;
      half_.z() = 0.5 * capsule->length;
      corners_ = {half_, -half_};
    } else if (const auto* cylinder = std::get_if<Cylinder>(&solid)) {
      half_ = Vector3(cylinder->radius, cylinder->radius, 0.5 * cylinder->length) - Vector3::Constant(margin_);
    } else {
      set_faces(std::get<ConvexHull>(solid));
    }
    inverse_ = pose_.orientation.conjugate();
    for (Vector3& corner : corners_) corner = pose_.position + pose_.orientation * corner;
    const Shape shape = std::visit([](const auto& of) { return Shape(of); }, shape_);
    radius_ = reach_from(shape, Vector3::Zero());
  }

  //! Distance from a point inside to the surface; outside minus the distance, or a little less [m].
  double depth(const Vector3& point) const { return margin_ + inner_depth(inverse_ * (point - pose_.position)); }

  //! A point of the piece that is near a point, the nearest one of all but hulls.
  Vector3 near(const Vector3& point) const {
    return pose_.position + pose_.orientation * inner_near(inverse_ * (point - pose_.position));
  }

  //! The farthest point of the solid, its edges sharp, in a direction.
  Vector3 support(const Vector3& direction) const {
    const Vector3 local = inverse_ * direction;
    const auto sign = [](double value) { return value < 0.0 ? -1.0 : 1.0; };
    Vector3 point = Vector3::Zero();
    if (const auto* box = std::get_if<Box>(&shape_)) {
      point = Vector3(sign(local.x()), sign(local.y()), sign(local.z())).cwiseProduct(0.5 * box->size);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape_)) {
      const double across = local.head<2>().norm();
      if (across > 0.0) point.head<2>() = cylinder->radius / across * local.head<2>();
      point.z() = 0.5 * cylinder->length * sign(local.z());
    } else if (const auto* hull = std::get_if<ConvexHull>(&shape_)) {
      const auto nearer = [&](const Vector3& a, const Vector3& b) { return a.dot(local) < b.dot(local); };
      point = *std::max_element(hull->points.begin(), hull->points.end(), nearer);
    } else {
      point = Vector3(0.0, 0.0, half_.z() * sign(local.z())) + margin_ * local.normalized();
    }
    return pose_.position + pose_.orientation * point;
  }

  const Vector3& center() const { return pose_.position; }          //!< a point inside
  double radius() const { return radius_; }                         //!< of a ball about the centre that holds it [m]
  double inner_radius() const { return depth(pose_.position); }     //!< of a ball about the centre inside of it [m]
  double half_extent() const { return half_extent_; }               //!< the smallest [m]
  double margin() const { return margin_; }                         //!< all of the radius of what is round [m]
  const std::vector<Vector3>& corners() const { return corners_; }  //!< without the margin; none of what is round

  //! Whether it is a point or a line with a radius around it: what meets it has sharp edges.
  bool is_round() const { return std::holds_alternative<Sphere>(shape_) || std::holds_alternative<Capsule>(shape_); }

  //! Whether anything is left without the margin: of a sliver of a hull there may be nothing.
  bool solid() const { return solid_; }

 private:
  static constexpr int most_corners = 64;    // of a hull that are looked at
  static constexpr int projections = 8;      // onto all faces of a hull
  static constexpr double same_face = 1e-9;  // of two normals, and of offsets as a share of the size

  static double depth_in_box(const Vector3& local, const Vector3& half) {
    const Vector3 out = local.cwiseAbs() - half;
    const double inside = out.maxCoeff();
    return inside <= 0.0 ? -inside : -out.cwiseMax(0.0).norm();
  }

  static double depth_in_cylinder(const Vector3& local, double radius, double half_length) {
    const double across = local.head<2>().norm() - radius;
    const double along = std::abs(local.z()) - half_length;
    const double inside = std::max(across, along);
    return inside <= 0.0 ? -inside : -std::hypot(std::max(across, 0.0), std::max(along, 0.0));
  }

  static std::vector<Vector3> box_corners(const Vector3& half) {
    std::vector<Vector3> corners;
    for (int i = 0; i < 8; ++i) {
      corners.push_back(Vector3(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0).cwiseProduct(half));
    }
    return corners;
  }

  struct Face {
    Vector3 normal;
    double offset;
  };

  double inner_depth(const Vector3& local) const {
    if (std::holds_alternative<Box>(shape_)) return depth_in_box(local, half_);
    if (std::holds_alternative<Sphere>(shape_)) return -local.norm();
    if (std::holds_alternative<Cylinder>(shape_)) return depth_in_cylinder(local, half_.x(), half_.z());
    if (std::holds_alternative<Capsule>(shape_)) return -(local - inner_near(local)).norm();
    double least = infinity;
    for (const Face& face : faces_) least = std::min(least, face.offset - face.normal.dot(local));
    return least >= 0.0 ? least : -(local - inner_near(local)).norm();
  }

  Vector3 inner_near(const Vector3& local) const {
    if (std::holds_alternative<Sphere>(shape_)) return Vector3::Zero();
    if (std::holds_alternative<Cylinder>(shape_)) {
      const double across = local.head<2>().norm();
      const double share = across > half_.x() ? half_.x() / across : 1.0;
      return {share * local.x(), share * local.y(), std::clamp(local.z(), -half_.z(), half_.z())};
    }
    if (!std::holds_alternative<ConvexHull>(shape_)) return local.cwiseMax(-half_).cwiseMin(half_);
    Vector3 point = local;
    for (int i = 0; i < projections; ++i) {
      for (const Face& face : faces_) point -= std::max(face.normal.dot(point) - face.offset, 0.0) * face.normal;
    }
    // What is still outside is drawn to the origin, which is inside.
    double share = 1.0;
    for (const Face& face : faces_) {
      const double reach = face.normal.dot(point);
      if (reach > face.offset) share = std::min(share, face.offset / reach);
    }
    return share * point;
  }

  // The hull is moved so that its frame's origin is the mean of its points, which is inside.
  void set_faces(const ConvexHull& hull) {
    ConvexHull moved = hull;
    Vector3 mean = Vector3::Zero();
    for (const Vector3& point : moved.points) mean += point / static_cast<double>(moved.points.size());
    for (Vector3& point : moved.points) point -= mean;
    pose_.position += pose_.orientation * mean;
    const double size = reach_from(moved, Vector3::Zero());
    for (const auto& [a, b, c] : hull_faces(moved.points)) {
      const Vector3& corner = moved.points[a];
      const Vector3 normal = (moved.points[b] - corner).cross(moved.points[c] - corner).normalized();
      const double offset = normal.dot(corner) - margin_;
      const auto same = [&](const Face& face) {
        return (face.normal - normal).norm() < same_face && std::abs(face.offset - offset) < same_face * size;
      };
      if (normal.allFinite() && std::none_of(faces_.begin(), faces_.end(), same)) faces_.push_back({normal, offset});
    }
    for (const Face& face : faces_) solid_ = solid_ && face.offset > 0.0;
    if (moved.points.size() <= most_corners) corners_ = moved.points;
    shape_ = std::move(moved);
  }

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
inline std::vector<ConvexPiece> convex_pieces(const Shape& shape, const Pose& pose,
                                              const std::optional<double>& margin) {
  std::vector<ConvexPiece> pieces;
  for (const auto& [solid, at] : solids_of(shape)) {
    const Pose placed{pose.position + pose.orientation * at.position, pose.orientation * at.orientation};
    ConvexPiece piece(solid, placed, margin);
    if (piece.solid()) pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace energymargin::bounds

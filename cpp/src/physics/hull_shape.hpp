#pragma once
// A convex hull for Bullet, and the points of one of which the farthest is asked for.

#include <btBulletCollisionCommon.h>

#include <atomic>
#include <utility>
#include <vector>

#include "base/pair.hpp"
#include "physics/bullet_math.hpp"
#include "physics/direction_table.hpp"

namespace energymargin {

//! Points of which the farthest is asked for. Their coordinates are together, two by two.
class PointSet {
 public:
  //! Those within `depth` of the farthest are asked for, too [m].
  explicit PointSet(const std::vector<btVector3>& points, double depth = 0.0);
  PointSet(const PointSet&) = delete;
  PointSet& operator=(const PointSet&) = delete;
  ~PointSet() { delete table_.load(); }

  //! The index of the first of those that are farthest along a direction.
  std::size_t farthest(const btVector3& direction) const {
    const DirectionTable::Candidates candidates = table().at(direction);
    return candidates.empty() ? farthest_of_all(direction) : farthest_of(candidates, direction);
  }

  //! How far they reach along a direction, at least and at most.
  std::pair<double, double> extent(const btVector3& direction) const;

  //! Calls `visit` with the indices of those that can be within `depth` of the farthest along a direction, in ascending
  //! order.
  template <typename Visit>
  void for_each_near(const btVector3& direction, double depth, const Visit& visit) const {
    const DirectionTable::Candidates candidates =
        depth <= depth_ ? table().at(direction) : DirectionTable::Candidates{};
    for (const DirectionTable::Index i : candidates) visit(std::size_t{i});
    if (!candidates.empty()) return;
    for (std::size_t i = 0; i < count_; ++i) visit(i);
  }

 private:
  std::size_t farthest_of(const DirectionTable::Candidates& candidates, const btVector3& direction) const;
  std::size_t farthest_of_all(const btVector3& direction) const;

  static constexpr std::size_t pairs = 4, block = 2 * pairs;
  // What is missing of the last block is the last point again.
  struct Block {
    Pair x[pairs], y[pairs], z[pairs];
  };

  //! That of these points, which the first caller makes: most sets are never asked for it.
  const DirectionTable& table() const {
    const DirectionTable* const made = table_.load(std::memory_order_acquire);
    return made ? *made : make_table();
  }
  const DirectionTable& make_table() const;
  btVector3 point(std::size_t i) const;
  double along(std::size_t i, const btVector3& direction) const;
  static Pair along(const Block& of, std::size_t pair, const btVector3& direction);

  std::size_t count_;
  std::vector<Block> blocks_;
  double depth_;
  mutable std::atomic<const DirectionTable*> table_{nullptr};  // without cells if the points are few
};

//! A convex hull with its margin inside, and the corners that it has with it. Bullet's hull is an inner shape with a
//! margin around it, whose corners are round: its faces are smaller than those of the points that it is made of. Where
//! it lies on a face, or stands on a plane, these corners count, as a box's do.
class HullShape : public btConvexHullShape {
 public:
  //! A face, with all that are nearly parallel to it.
  struct Face {
    btVector3 normal;
    double offset = 0.0;  // normal . x = offset [m]
    double area = 0.0;    // [m^2]
    std::vector<btVector3> corners{};
  };

  //! The points of the inner shape, the margin around it, and the corners and faces of both together.
  struct Hull {
    std::vector<btVector3> inner, corners;
    double margin = 0.0;  // [m]
    std::vector<Face> faces{};
  };

  explicit HullShape(const Hull& hull);

  //! The hull of points, with at most this margin inside [m].
  HullShape(const std::vector<Vector3>& points, double margin);

  const std::vector<btVector3>& corners() const { return corners_; }

  bool has_faces() const { return !faces_.empty(); }

  //! That whose normal is nearest to a direction.
  const Face& face_along(const btVector3& direction) const { return faces_[normals_.farthest(direction)]; }

  //! Calls `visit` with the normals and offsets of the faces whose cosine with a direction is at least `near`.
  template <typename Visit>
  void for_each_face_near(const btVector3& direction, double near, const Visit& visit) const {
    normals_.for_each_near(direction, 1.0 - near, [&](std::size_t i) {
      if (direction.dot(faces_[i].normal) >= near) visit(faces_[i].normal, faces_[i].offset);
    });
  }

  //! Of the inner shape's points that farthest along a direction, the first of them.
  const btVector3& farthest_point(const btVector3& direction) const {
    return getUnscaledPoints()[points_.farthest(direction)];
  }

  //! Of the corners that farthest along a direction, the first of them.
  const btVector3& farthest_corner(const btVector3& direction) const {
    return corners_[corner_points_.farthest(direction)];
  }

  //! Calls `visit` with those of the corners that can be within `depth` of the farthest along a unit vector [m].
  template <typename Visit>
  void for_each_corner_near(const btVector3& direction, double depth, const Visit& visit) const {
    corner_points_.for_each_near(direction, depth, [&](std::size_t i) { visit(corners_[i]); });
  }

  //! How far the corners reach along a direction, at least and at most.
  std::pair<double, double> extent(const btVector3& direction) const { return corner_points_.extent(direction); }

  //! Half the diagonal of the box around it [m].
  double size() const { return 0.5 * (high_ - low_).length(); }

  btVector3 localGetSupportingVertex(const btVector3& direction) const override { return farthest_corner(direction); }
  void getAabb(const btTransform& pose, btVector3& low, btVector3& high) const override;

 private:
  std::vector<btVector3> corners_;
  std::vector<Face> faces_;
  PointSet points_, corner_points_, normals_;
  btVector3 low_, high_;
};

}  // namespace energymargin

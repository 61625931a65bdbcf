#pragma once
// Where an object may be: X_free of Definition 1, the poses in which it penetrates nothing.

#include <algorithm>
#include <optional>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "physics/contacts/plane_contacts.hpp"

namespace energymargin {

//! The free space of one object while everything else stays where it is. An object that touches is free: it may be as
//! deep in a body as at the start, and a little deeper. One thread at a time.
class FreeSpace {
 public:
  //! `object` is the index of a body that moves freely; `state` says where everything is.
  FreeSpace(const Scene& scene, const State& state, std::size_t object) : scene_(scene) {
    MovingBodies bodies(scene_);
    bodies.restore(state);
    const BodyState start = Kinematics(scene)(state.data(), object);
    const Pose pose{start.position, start.orientation};
    // What the simulation makes of a body's frame is the same in every pose.
    const btTransform in_frame = to_bullet(pose).inverse() * bodies.poses()[object];
    for (const ConvexPiece& piece : scene_.collision_shape(object).pieces) {
      btVector3 centre;
      btScalar radius = 0.0;
      piece.shape->getBoundingSphere(centre, radius);
      pieces_.push_back({piece.shape, piece.pose(in_frame), radius + centre.length()});
    }
    tolerance_ = touching * scene.smallest_half_extent(object);
    const CollisionFilter can_collide(scene);
    for (std::size_t other = 0; other < scene.bodies().size(); ++other) {
      if (other == object || !can_collide(object, other)) continue;
      add_obstacles(scene.collision_shape(other), bodies.poses()[other]);
    }
    for (Obstacle& obstacle : obstacles_) {
      obstacle.depth = tolerance_ + std::max(0.0, -distance(to_bullet(pose), obstacle, 0.0));
    }
  }

  //! How far every point of the object can move before it is in anything [m], up to `reach`; negative: not free. `pose`
  //! is that of the body's frame.
  double clearance(const Pose& pose, double reach) const {
    const btTransform at = to_bullet(pose);
    double least = reach;
    for (const Obstacle& obstacle : obstacles_) {
      least = std::min(least, distance(at, obstacle, std::max(least, 0.0)) + obstacle.depth);
      if (least < 0.0) break;
    }
    return least;
  }

  //! How much deeper than at the start the object may be in a body [m]: so that it can slide along what it rests on.
  double tolerance() const { return tolerance_; }

 private:
  // Share of the object's smallest half extent that it may be in a body, besides what it is at the start.
  static constexpr double touching = 2e-4;

  // A convex piece of the object.
  struct Piece {
    const btConvexShape* shape;
    btTransform in_object;
    double radius;  // about the origin of its own frame
  };

  // A convex piece of another body, or a plane, where it stays.
  struct Obstacle {
    const btConvexShape* solid;  // null: a plane
    btTransform pose;
    std::optional<WorldPlane> plane{};
    Bounds bounds{};
    double depth = 0.0;  // that counts as touching
  };

  void add_obstacles(const CollisionShape& other, const btTransform& pose) {
    if (!other.shape->isCompound() && other.pieces.empty()) {
      obstacles_.push_back({nullptr, pose, WorldPlane(static_cast<const btStaticPlaneShape&>(*other.shape), pose)});
    }
    for (const ConvexPiece& piece : other.pieces) {
      obstacles_.push_back({piece.shape, piece.pose(pose), {}, bounds_of(*piece.shape, piece.pose(pose))});
    }
  }

  double distance(const btTransform& object, const Obstacle& obstacle, double reach) const {
    double least = reach;
    for (const Piece& piece : pieces_) {
      const btTransform at = object * piece.in_object;
      if (obstacle.plane) {
        least = std::min(least, closest_to_plane(InnerShape(*piece.shape, Edges::sharp), at, *obstacle.plane).distance);
      } else if (!far(at.getOrigin(), piece.radius + std::max(least, 0.0), obstacle.bounds)) {
        const auto closest = sharp_closest(*piece.shape, at, *obstacle.solid, obstacle.pose, std::max(least, 0.0));
        if (closest) least = std::min(least, closest->distance);
      }
    }
    return least;
  }

  static bool far(const btVector3& centre, double reach, const Bounds& bounds) {
    btVector3 nearest = centre;
    nearest.setMax(bounds.low);
    nearest.setMin(bounds.high);
    return (centre - nearest).length2() > reach * reach;
  }

  Scene scene_;  // has the shapes
  std::vector<Piece> pieces_;
  std::vector<Obstacle> obstacles_;
  double tolerance_ = 0.0;
};

}  // namespace energymargin

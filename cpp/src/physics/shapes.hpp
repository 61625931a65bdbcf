#pragma once
// Bullet's collision shapes for ours.

#include <btBulletCollisionCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "physics/hull_shape.hpp"

namespace energymargin {

//! Where Bullet's frame of a body is: at its centre of mass, along its principal axes.
btTransform bullet_pose(const Inertial& inertial, const BodyState& frame);

//! The state of a body's frame, from the pose and the velocities of its centre of mass.
BodyState frame_state(const Inertial& inertial, const btTransform& pose, const Vector3& velocity,
                      const Vector3& angular_velocity);

//! An axis-aligned box [m].
struct Bounds {
  btVector3 low, high;
};

inline Bounds bounds_of(const btCollisionShape& shape, const btTransform& pose) {
  Bounds bounds;
  shape.getAabb(pose, bounds.low, bounds.high);
  return bounds;
}

//! A convex piece of a body.
struct ConvexPiece {
  const btConvexShape* shape;
  btTransform in_body;
  bool at_origin;      // whether it stands in its body's own frame
  double reach;        // of its corners, or of the centre of what is round, from the body's origin [m]
  double half_extent;  // the smallest [m]
  Bounds bounds{};     // in its body's frame

  [[gnu::always_inline]] btTransform pose(const btTransform& body) const { return at_origin ? body : body * in_body; }
};

//! A collision shape, which nothing changes once it is made: worlds on several threads share it.
struct CollisionShape {
  std::shared_ptr<btCollisionShape> shape;
  std::vector<std::shared_ptr<btCollisionShape>> parts{};  //!< that a compound is made of; equal hulls are one
  std::vector<ConvexPiece> pieces{};                       //!< none of a plane: behind it all is solid
  double reach = 0.0;                                      //!< of the pieces' points from the body's origin [m]
};

}  // namespace energymargin

#pragma once
// Bullet's collision shapes for ours.

#include <btBulletCollisionCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"

namespace energymargin {

inline btVector3 to_bullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bullet(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Vector3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Quaternion from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

inline btTransform to_bullet(const Pose& pose) {
  return btTransform(to_bullet(pose.orientation), to_bullet(pose.position));
}

//! Where Bullet's frame of a body is: at its centre of mass, along its principal axes.
btTransform bullet_pose(const Inertial& inertial, const BodyState& frame);

//! Index in the scene of a body that Bullet has.
inline std::size_t body_index(const btCollisionObject& object) {
  return static_cast<std::size_t>(object.getUserIndex());
}

//! A collision shape and the parts that it is made of.
struct CollisionShape {
  std::unique_ptr<btCollisionShape> shape;
  std::vector<std::unique_ptr<btCollisionShape>> parts{};
  std::vector<double> half_extents{};  //!< the smallest of each convex piece [m]
};

//! The collision shape in a frame at the body's centre of mass, along its principal axes, as Bullet wants it. Its outer
//! surface is the true one: the margin lies inside and only rounds the edges. `margin` unset: a twentieth of the
//! smallest half extent of each part.
CollisionShape collision_shape(const Body& body, std::optional<double> margin);

//! Those of all bodies, with the scene's margin.
std::vector<CollisionShape> collision_shapes(const Scene& scene);

}  // namespace energymargin

#pragma once
// Bullet's collision shapes for ours.

#include <btBulletCollisionCommon.h>

#include <memory>
#include <optional>

#include "energymargin/shape.hpp"

namespace energymargin {

inline btVector3 to_bullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bullet(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Vector3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Quaternion from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

//! The collision shape, in the frame of the shape's principal axes. Its outer surface is the true one: the margin
//! lies inside and only rounds the edges. `margin` unset: a twentieth of the smallest half extent.
std::unique_ptr<btCollisionShape> collision_shape(const Shape& shape, std::optional<double> margin);

}  // namespace energymargin

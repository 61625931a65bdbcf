#pragma once
// Vectors, turns and poses for Bullet, and back.

#include <LinearMath/btTransform.h>

#include "energymargin/scene.hpp"

namespace energymargin {

inline btVector3 to_bullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bullet(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Vector3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Quaternion from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

inline btTransform to_bullet(const Pose& pose) {
  return btTransform(to_bullet(pose.orientation), to_bullet(pose.position));
}

}  // namespace energymargin

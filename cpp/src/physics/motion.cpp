#include "physics/motion.hpp"

#include <cmath>

namespace energymargin {
namespace {

// Near no turn the sine is as good as its first terms.
constexpr double small_turn = 1e-3;  // rad

btQuaternion turned(const btQuaternion& orientation, const btVector3& turn) {
  const double squared = turn.length2();
  const double angle = btSqrt(squared);
  const double sine = angle < small_turn ? 0.5 - squared / 48.0 : std::sin(0.5 * angle) / angle;
  const double cosine = angle < small_turn ? 1.0 - squared / 8.0 : std::cos(0.5 * angle);
  return (btQuaternion(sine * turn.x(), sine * turn.y(), sine * turn.z(), cosine) * orientation).normalized();
}

// Where a body is that has moved with a twist that is constant in space.
btTransform screw_motion(const btTransform& start, const btVector3& linear, const btVector3& angular) {
  const double turn = angular.length();
  if (turn < 1e-9) return btTransform(start.getBasis(), start.getOrigin() + linear);
  const btVector3 once = angular.cross(linear);
  const btVector3 offset = linear + once * ((1.0 - std::cos(turn)) / (turn * turn)) +
                           angular.cross(once) * ((turn - std::sin(turn)) / (turn * turn * turn));
  return btTransform(btMatrix3x3(btQuaternion(angular / turn, turn)) * start.getBasis(), start.getOrigin() + offset);
}

}  // namespace

btTransform moved_pose(const btTransform& start, const btVector3& way, const btVector3& turn) {
  return btTransform(turned(start.getRotation(), turn), start.getOrigin() + way);
}

btTransform Sweep::at(double share) const {
  if (share == 0.0) return start;
  if (screw) return screw_motion(start, linear * share, angular * share);
  return moved_pose(start, linear * share, angular * share);
}

btVector3 Sweep::turned(const btVector3& direction, double share) const {
  const double turn = angular.length() * share;
  return turn == 0.0 ? direction : direction.rotate(angular.normalized(), turn);
}

double Sweep::along(const btVector3& direction) const {
  return screw && !angular.isZero() ? linear.length() : direction.dot(linear);
}

double Sweep::bend(double reach) const {
  const double turn = angular.length();
  return turn * (turn * reach + (screw ? linear.length() : 0.0));
}

}  // namespace energymargin

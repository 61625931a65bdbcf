#include "physics/sweep.hpp"

#include <LinearMath/btTransformUtil.h>

#include <cmath>

namespace energymargin {
namespace {

// Beyond it Bullet goes on along the tangent of the quaternion, and normalizes that.
constexpr double most_turn = ANGULAR_MOTION_THRESHOLD;  // rad

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

btVector3 integrated_turn(const btVector3& turn) {
  const double angle = turn.length();
  if (!(angle > most_turn)) return turn;
  return turn * (2.0 * std::atan(angle / most_turn * std::tan(0.5 * most_turn)) / angle);
}

btTransform integrated_pose(const btTransform& start, const btVector3& way, const btVector3& turn, double share) {
  btTransform pose;
  const double angle = turn.length() * share;
  if (angle > most_turn) {
    pose.setRotation((btQuaternion(turn.normalized(), angle) * start.getRotation()).normalized());
    pose.setOrigin(start.getOrigin() + way * share);
  } else {
    btTransformUtil::integrateTransform(start, way, turn, share, pose);
  }
  return pose;
}

btTransform Sweep::at(double share) const {
  if (share == 0.0) return start;
  if (screw) return screw_motion(start, linear * share, angular * share);
  return integrated_pose(start, linear, angular, share);
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

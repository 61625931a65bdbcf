#pragma once
// How bodies move, where they touch, and what acts on them. A body is named by its index in the scene.

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "base/portable.hpp"
#include "energymargin/audit.hpp"

namespace energymargin {

//! Velocity of a body's centre of mass, which is Bullet's origin of it [m/s], and its angular velocity [rad/s].
struct Velocity {
  btVector3 linear = btVector3(0, 0, 0);
  btVector3 angular = btVector3(0, 0, 0);

  //! Along or about an axis of the world: 0..2 linear, 3..5 angular.
  double& operator[](int axis) { return axis < 3 ? linear[axis] : angular[axis - 3]; }
  double operator[](int axis) const { return axis < 3 ? linear[axis] : angular[axis - 3]; }
};

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;
  btVector3 force, torque;

  //! Mean power on a body that goes from one velocity to another [W]. With the velocities before a substep and after
  //! its impulses, from where the body coasts, the work on a free body is exactly its gain of kinetic energy.
  double power(const Velocity& before, const Velocity& after) const {
    return 0.5 * (force.dot(before.linear + after.linear) + torque.dot(before.angular + after.angular));
  }
};

//! A motor that keeps a free body at the velocities of its centre of mass, with limited force and torque along and
//! about each axis of the world. A kinematic body has these velocities.
struct Motor {
  std::size_t body;
  Velocity velocity;
  double force, torque;  // [N], [N m]
};

//! A point where two bodies touch, or nearly do, as they stand; nothing of it is kept from one substep to the next.
struct ContactPoint {
  std::size_t a, b;
  btVector3 on_a, on_b;
  btVector3 grip;               // where friction acts: of a round face, inside of the points that carry the load
  btVector3 normal;             // from b to a
  double distance;              // negative in penetration [m]
  double friction;              // coefficient
  double lever = 0.0;           // of friction about `grip`, where it acts over a patch [m]
  double normal_impulse = 0.0;  // on a, of the last substep [N s]
  btVector3 friction_impulse = btVector3(0, 0, 0);  // on a [N s]
  btVector3 friction_twist = btVector3(0, 0, 0);    // on a, of torsional and rolling friction [N m s]
};

//! A turn about an axis by an angle [rad].
inline btQuaternion turned_about(const btVector3& axis, double angle) {
  const btVector3 vector = axis * (portable::sin(0.5 * angle) / axis.length());
  return {vector.x(), vector.y(), vector.z(), portable::cos(0.5 * angle)};
}

//! A pose after a way [m] and a turn [rad], about an axis that stays.
inline btTransform moved_pose(const btTransform& start, const btVector3& way, const btVector3& turn) {
  constexpr double small_turn = 1e-3;  // rad: near no turn the sine is as good as its first terms
  const double squared = turn.length2();
  const double angle = btSqrt(squared);
  const double sine = angle < small_turn ? 0.5 - squared / 48.0 : portable::sin(0.5 * angle) / angle;
  const double cosine = angle < small_turn ? 1.0 - squared / 8.0 : portable::cos(0.5 * angle);
  const btQuaternion turned(sine * turn.x(), sine * turn.y(), sine * turn.z(), cosine);
  return btTransform((turned * start.getRotation()).normalized(), start.getOrigin() + way);
}

//! Where a body is that has moved with a twist that is constant in space.
inline btTransform screw_motion(const btTransform& start, const btVector3& linear, const btVector3& angular) {
  const double turn = angular.length();
  if (turn < 1e-9) return btTransform(start.getBasis(), start.getOrigin() + linear);
  const btVector3 once = angular.cross(linear);
  const btVector3 offset = linear + once * ((1.0 - portable::cos(turn)) / (turn * turn)) +
                           angular.cross(once) * ((turn - portable::sin(turn)) / (turn * turn * turn));
  return btTransform(btMatrix3x3(turned_about(angular / turn, turn)) * start.getBasis(), start.getOrigin() + offset);
}

//! A body on its way through a substep.
struct Sweep {
  btTransform start;
  btVector3 linear, angular;  // over the whole of it, as they are at the start [m], [rad]
  bool screw;                 // of a link: its velocity turns with it, as about the pivot of a joint

  btTransform at(double share) const {
    if (share == 0.0) return start;
    if (screw) return screw_motion(start, linear * share, angular * share);
    return moved_pose(start, linear * share, angular * share);
  }

  //! The first share of it.
  Sweep first(double share) const { return {start, linear * share, angular * share, screw}; }

  //! A direction that turns with it.
  btVector3 turned(const btVector3& direction, double share) const {
    const double turn = angular.length() * share;
    return turn == 0.0 ? direction : direction.rotate(angular.normalized(), turn);
  }

  //! How far it can move along a direction on its whole way [m].
  double along(const btVector3& direction) const {
    return screw && !angular.isZero() ? linear.length() : direction.dot(linear);
  }

  //! By how much the velocity of a point at `reach` from the body's origin changes, over the whole of it [m].
  double bend(double reach) const {
    const double turn = angular.length();
    return turn * (turn * reach + (screw ? linear.length() : 0.0));
  }
};

//! Velocities and loads of all that moves.
struct Motion {
  struct OfBody {
    Velocity velocity;
    btVector3 force, torque;  // of gravity, the body's constant force and the springs' stiffness [N, N m]
  };
  std::vector<OfBody> bodies;              // not of links
  std::vector<std::vector<double>> trees;  // velocities of a free base, then of the joints
};

//! Work of the solver's impulses since `before` was set: each times the mean velocity along it over the step.
struct ImpulseAudit {
  //! What the next step begins with, for the owner to keep up to date; null: no audit.
  const Motion* before = nullptr;
  Audit work{};
};

}  // namespace energymargin

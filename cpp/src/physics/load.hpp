#pragma once
// What acts on a body.

#include <btBulletDynamicsCommon.h>

#include <cstddef>

#include "physics/velocity.hpp"

namespace energymargin {

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;  // index in the scene
  btVector3 force, torque;

  //! Its mean power on a body that goes from one velocity to another [W]. Over a part of a step the mean of the
  //! velocities before and after, where it coasts from, makes the work on a free body its gain of kinetic energy,
  //! exactly.
  double power(const Velocity& before, const Velocity& after) const {
    return 0.5 * (force.dot(before.linear + after.linear) + torque.dot(before.angular + after.angular));
  }
};

//! A motor that keeps a free body at the velocities of its centre of mass, with limited force and torque along and
//! about each axis of the world. A kinematic body has these velocities.
struct Motor {
  std::size_t body;           // index in the scene
  btVector3 linear, angular;  // [m/s], [rad/s]
  double force, torque;       // [N], [N m]
};

}  // namespace energymargin

#pragma once
// What acts on a body.

#include <btBulletDynamicsCommon.h>

#include <cstddef>

namespace energymargin {

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;  // index in the scene
  btVector3 force, torque;
};

//! A motor that keeps a free body at the velocities of its centre of mass, with limited force and torque along and
//! about each axis of the world. A kinematic body has these velocities.
struct Motor {
  std::size_t body;           // index in the scene
  btVector3 linear, angular;  // [m/s], [rad/s]
  double force, torque;       // [N], [N m]
};

}  // namespace energymargin

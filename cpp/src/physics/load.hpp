#pragma once
// What pushes a body, and how fast a body moves.

#include <btBulletDynamicsCommon.h>

#include <cstddef>

namespace energymargin {

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;  // index in the scene
  btVector3 force, torque;
};

//! Of a body's centre of mass, which is Bullet's origin of it [m/s], and its angular velocity [rad/s].
struct Velocity {
  btVector3 linear = btVector3(0, 0, 0);
  btVector3 angular = btVector3(0, 0, 0);
};

//! Keeps a free body at the velocities of its centre of mass, with limited force and torque along and about each axis
//! of the world.
struct Motor {
  std::size_t body;           // index in the scene
  btVector3 linear, angular;  // [m/s], [rad/s]
  double force, torque;       // [N], [N m]
};

}  // namespace energymargin

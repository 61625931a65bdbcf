#pragma once
// A motor that keeps a free body at a velocity, within its limits.

#include <btBulletDynamicsCommon.h>

#include <cstddef>

namespace energymargin {

//! Of a body by its index in the scene: velocities of its centre of mass [m/s, rad/s], and the most along and about
//! each axis of the world [N, N m].
struct Motor {
  std::size_t body;
  btVector3 linear, angular;
  double force, torque;
};

}  // namespace energymargin

#pragma once
// How fast a body moves.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! Of a body's centre of mass, which is Bullet's origin of it [m/s], and its angular velocity [rad/s].
struct Velocity {
  btVector3 linear = btVector3(0, 0, 0);
  btVector3 angular = btVector3(0, 0, 0);
};

}  // namespace energymargin

#pragma once
// A point where two bodies touch, or nearly do.

#include <btBulletDynamicsCommon.h>

#include <cstddef>

namespace energymargin {

//! As the bodies stand; nothing of it is kept from one substep to the next.
struct ContactPoint {
  std::size_t a, b;  // indices of the bodies in the scene
  btVector3 on_a, on_b;
  btVector3 grip;               // where friction acts: of a round face, inside of the points that carry the load
  btVector3 normal;             // from b to a
  double distance;              // negative in penetration [m]
  double friction;              // coefficient
  double normal_impulse = 0.0;  // on a, of the last substep [N s]
  btVector3 friction_impulse = btVector3(0, 0, 0);  // on a [N s]
};

}  // namespace energymargin

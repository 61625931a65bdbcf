#pragma once
// The work of a step's impulses, for the energy audit.

#include <btBulletDynamicsCommon.h>

#include <vector>

namespace energymargin {

//! Velocities and loads of all that moves, as Bullet has them.
struct Motion {
  struct OfBody {
    btVector3 linear, angular;  // [m/s], [rad/s]
    btVector3 force, torque;    // of gravity, the body's constant force and the springs' stiffness [N, N m]
  };
  std::vector<OfBody> bodies;              // by their index in the scene; not of links
  std::vector<std::vector<double>> trees;  // velocities of a free base, then of the joints
};

//! Work of the solver's impulses [J].
struct ImpulseWork {
  double contacts = 0.0;  // of normal impulses
  double friction = 0.0;
  double joints = 0.0;   // of stops and mimics, not of drives
  double motors = 0.0;   // of the robot's servos, and of what drives kinematic bodies
  double overlap = 0.0;  // of penetration recovery against the loads
  double gravity = 0.0;  // on trees that feel it as they coast, beside what steps of first order would count
};

//! Work of the impulses since `before` was set. A solver adds to it while `before` is not null: each impulse times the
//! mean of the velocity along it before the step and after it.
struct ImpulseAudit {
  //! What the next step begins with, for the owner to keep up to date; null: no audit.
  const Motion* before = nullptr;
  ImpulseWork work{};
};

}  // namespace energymargin

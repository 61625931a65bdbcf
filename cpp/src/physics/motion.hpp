#pragma once
// How bodies move, and what acts on them.

#include <btBulletDynamicsCommon.h>

#include <cstddef>
#include <vector>

namespace energymargin {

//! Velocity of a body's centre of mass, which is Bullet's origin of it [m/s], and its angular velocity [rad/s].
struct Velocity {
  btVector3 linear = btVector3(0, 0, 0);
  btVector3 angular = btVector3(0, 0, 0);
};

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;  // index in the scene
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
  std::size_t body;           // index in the scene
  btVector3 linear, angular;  // [m/s], [rad/s]
  double force, torque;       // [N], [N m]
};

//! Velocities and loads of all that moves.
struct Motion {
  struct OfBody {
    btVector3 linear, angular;  // [m/s], [rad/s]
    btVector3 force, torque;    // of gravity, the body's constant force and the springs' stiffness [N, N m]
  };
  std::vector<OfBody> bodies;              // by their index in the scene; not of links
  std::vector<std::vector<double>> trees;  // velocities of a free base, then of the joints
};

//! Work of the solver's impulses [J]: each times the mean of the velocity along it before the step and after it.
struct ImpulseWork {
  double contacts = 0.0;  // of normal impulses
  double friction = 0.0;
  double joints = 0.0;   // of stops and mimics, not of drives
  double motors = 0.0;   // of the robot's servos, and of what drives kinematic bodies
  double overlap = 0.0;  // of penetration recovery against the loads
  double gravity = 0.0;  // on trees that feel it as they coast, beside what steps of first order would count
};

//! Work of the impulses since `before` was set, for the energy audit.
struct ImpulseAudit {
  //! What the next step begins with, for the owner to keep up to date; null: no audit.
  const Motion* before = nullptr;
  ImpulseWork work{};
};

}  // namespace energymargin

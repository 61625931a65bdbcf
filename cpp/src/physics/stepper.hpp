#pragma once
// One step of a scene: contacts, velocities, motion.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/contacts/collision_pairs.hpp"
#include "physics/free_bodies/motor.hpp"

namespace energymargin {

//! How a body moves: Bullet's origin of it, which is its centre of mass [m/s], and its turning [rad/s].
struct Velocity {
  btVector3 linear = btVector3(0, 0, 0);
  btVector3 angular = btVector3(0, 0, 0);
};

//! A step in two halves, so that the first one can be undone: where bodies would pass into each other, the step has to
//! be a shorter one.
class Stepper {
 public:
  explicit Stepper(btCollisionDispatcher& dispatcher) : pairs_(dispatcher) {}
  virtual ~Stepper() = default;

  CollisionPairs& pairs() { return pairs_; }

  //! What keeps bodies at velocities in the next steps.
  std::vector<Motor>& motors() { return motors_; }
  const std::vector<Motor>& motors() const { return motors_; }

  //! Keeps the velocities and poses, for `undo`.
  virtual void keep() = 0;
  virtual void undo() = 0;

  //! Takes back the split impulses of `solve`; velocities stay.
  virtual void undo_split_impulses() = 0;

  //! Velocities at the end of a step of `duration` [s], with the contacts that `pairs` has now.
  virtual void solve(double duration, btContactSolverInfo& info) = 0;

  //! The velocities of all moving bodies, each at the index of its body in the scene.
  virtual void read(std::vector<Velocity>& velocities) const = 0;

  //! Moves with these velocities for a share of `duration` [s].
  virtual void move(double duration, double share) = 0;

 private:
  CollisionPairs pairs_;
  std::vector<Motor> motors_;
};

}  // namespace energymargin

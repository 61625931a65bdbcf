#pragma once
// The bodies of a scene in Bullet, and how a part of a step changes their velocities and poses.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/impulse_work.hpp"
#include "physics/load.hpp"
#include "physics/velocity.hpp"

namespace energymargin {

//! What a part of a step is solved with.
struct StepPart {
  double duration;                                     // [s]
  const std::vector<btPersistentManifold*>& touching;  // contacts, by the indices of their bodies
  const std::vector<Motor>& motors;
  const btContactSolverInfo& solver;
};

//! There is one implementation for scenes without joints, FreeBodies, and one for those with joints, ArticulatedBodies.
//! A part of a step has two halves, velocities and motion, so that the first one can be undone: where bodies would pass
//! into each other, the part has to be a shorter one.
class Stepper {
 public:
  Stepper() = default;
  virtual ~Stepper() = default;
  Stepper(const Stepper&) = delete;
  Stepper& operator=(const Stepper&) = delete;

  //! All bodies, in the scene's order.
  const std::vector<btCollisionObject*>& colliders() const { return colliders_; }

  //! Free bodies of role "object", in the scene's order.
  virtual const std::vector<btRigidBody*>& objects() const = 0;

  //! Puts all bodies where a state says; nothing of the past is left.
  virtual void restore(const State& state) = 0;

  //! Writes the bodies' numbers into a state of the scene's dimension.
  virtual void read(State& state) const = 0;

  //! Reads the velocities of all bodies that move, each at the index of its body in the scene.
  virtual void read(std::vector<Velocity>& velocities) const = 0;

  //! Reads velocities and loads, without those of springs.
  virtual void read(Motion& motion) const = 0;

  //! Velocity of the point of a body that is at `point` in the world [m/s].
  virtual btVector3 velocity(std::size_t body, const btVector3& point) const = 0;

  //! Changes velocities by a load, and by gravity and the bodies' constant forces, over `duration` [s].
  virtual void apply(const Load& load, double duration) = 0;
  virtual void accelerate(double duration) = 0;

  //! Target of a joint, until the next `restore`; scenes without joints have none.
  virtual void set_target(std::size_t, double) {}
  virtual double target(std::size_t) const { return 0.0; }

  //! Saves the velocities and poses, for `undo`.
  virtual void save() = 0;
  virtual void undo() = 0;

  //! Takes back the split impulses of `solve`; velocities stay.
  virtual void undo_split_impulses() = 0;

  //! Velocities at the end of the part; false if the contact solver did not converge to them.
  virtual bool solve(const StepPart& part) = 0;

  //! Moves with these velocities for a share of `duration` [s].
  virtual void move(double duration, double share) = 0;

  ImpulseAudit& impulses() { return impulses_; }
  const ImpulseAudit& impulses() const { return impulses_; }

 protected:
  std::vector<btCollisionObject*> colliders_;
  ImpulseAudit impulses_;
};

}  // namespace energymargin

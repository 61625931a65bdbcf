#pragma once
// The step of a scene without joints.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/free_bodies/contact_solver.hpp"
#include "physics/free_bodies/rigid_motions.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Free and fixed bodies in contact. One step does what Bullet's world does in one, to the same bits but for the order
//! of several contacts of one pair of compounds, and without what these scenes have no use for: sleep, islands, swept
//! bounds, and a search for the few pairs that there are.
class FreeBodies : public Stepper {
 public:
  using Stepper::Stepper;

  void add(btRigidBody& moving) { moving_.push_back(&moving); }
  ContactSolver& solver() { return solver_; }
  const ContactSolver& solver() const { return solver_; }

  void keep() override { kept_.keep(moving_); }
  void undo() override { kept_.undo(moving_); }
  void undo_split_impulses() override { kept_.undo_split_impulses(moving_); }
  void solve(double duration, btContactSolverInfo& info) override;
  void read(std::vector<Velocity>& velocities) const override;
  void move(double duration, double share) override;

 private:
  ContactSolver solver_;
  std::vector<btRigidBody*> moving_;
  RigidMotions kept_;
};

}  // namespace energymargin

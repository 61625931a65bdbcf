#pragma once
// The step of a scene without joints.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "collision_pairs.hpp"
#include "contact_solver.hpp"

namespace energymargin {

//! Free and fixed bodies in contact. One step does what Bullet's world does in one, to the same bits but for the order
//! of several contacts of one pair of compounds, and without what these scenes have no use for: sleep, islands, swept
//! bounds, and a search for the few pairs that there are.
class FreeBodies {
 public:
  explicit FreeBodies(btCollisionDispatcher& dispatcher) : pairs_(dispatcher) {}

  void add(btRigidBody& moving) { moving_.push_back(&moving); }
  CollisionPairs& pairs() { return pairs_; }
  ContactSolver& solver() { return solver_; }
  const ContactSolver& solver() const { return solver_; }

  void step(double duration, btContactSolverInfo& info);

 private:
  CollisionPairs pairs_;
  ContactSolver solver_;
  std::vector<btRigidBody*> moving_;
};

}  // namespace energymargin

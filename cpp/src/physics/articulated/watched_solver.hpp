#pragma once
// Bullet's solver, with a view on the work of its impulses.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <btBulletDynamicsCommon.h>

#include <map>
#include <vector>

#include "physics/articulated/tree_rows.hpp"

namespace energymargin {

//! How all that moves does so, as Bullet keeps it.
struct Motion {
  struct OfBody {
    btVector3 linear, angular;
    btVector3 force, torque;  // of gravity, the body's constant force and the springs' stiffness [N, N m]
  };
  std::vector<OfBody> bodies;                               // by their index in the scene; not of links
  std::map<const btMultiBody*, std::vector<double>> trees;  // of the base, then of the joints
};

//! Work of what the solver does [J].
struct ImpulseWork {
  double contacts = 0.0;  // of normal impulses
  double friction = 0.0;
  double joints = 0.0;   // of stops and mimics, not of drives
  double motors = 0.0;   // of the robot's servos
  double overlap = 0.0;  // of penetration recovery against the loads
};

//! Solves as Bullet does, with the rounds over rows of trees done by TreeRows. While it is watched it also sums up
//! work: each impulse times the mean of the velocity along it before the step and after it.
class WatchedSolver : public btMultiBodyConstraintSolver {
 public:
  //! Whether TreeRows does the rounds, or Bullet.
  void use_own_rounds(bool own) { own_rounds_ = own; }

  //! `before` is what the next steps begin with, for the caller to keep up to date; null ends the watch.
  void watch(const Motion* before);

  //! Since the watch began.
  const ImpulseWork& work() const { return work_; }

  //! Back to what it was before a step that is undone.
  void set_work(const ImpulseWork& work) { work_ = work; }

 protected:
  btScalar solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int body_count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count, btTypedConstraint** constraints,
                                int constraint_count, const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  void add_work();
  void add_overlap(const btContactSolverInfo& info);
  double work_of(const btSolverConstraint& row) const;
  double work_of(const btMultiBodySolverConstraint& row) const;
  double mean_speed(int solver_body, const btVector3& normal, const btVector3& arm_cross_normal) const;
  double mean_speed(const btMultiBody& tree, int jacobian, int changes) const;

  bool own_rounds_ = true;
  TreeRows tree_rows_;
  const Motion* before_ = nullptr;
  ImpulseWork work_;
};

}  // namespace energymargin

#pragma once
// Bullet's solver for multi-bodies, faster and with the work of its impulses.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <btBulletDynamicsCommon.h>

#include "physics/articulated/tree_rows.hpp"
#include "physics/impulse_work.hpp"

namespace energymargin {

//! Solves as Bullet does, with the rounds over rows of trees done by TreeRows. It adds up the work of the impulses for
//! an audit.
class MultiBodySolver : public btMultiBodyConstraintSolver {
 public:
  //! Who does the rounds over the rows of trees.
  enum class Rounds {
    tree_rows,
    bullet,  ///< for comparison
  };

  //! Adds to the work of `audit`, which outlives this, while that is on.
  explicit MultiBodySolver(ImpulseAudit& audit, Rounds rounds = Rounds::tree_rows) : audit_(audit), rounds_(rounds) {}

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

  ImpulseAudit& audit_;
  Rounds rounds_;
  TreeRows tree_rows_;
};

}  // namespace energymargin

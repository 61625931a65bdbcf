#include "physics/articulated/multi_body_solver.hpp"

#include <algorithm>

#include "physics/articulated/joint_rows.hpp"
#include "physics/articulated/motor_rows.hpp"

namespace energymargin {

// Joints need two friction directions, so there are two.
btScalar MultiBodySolver::solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int body_count,
                                                            btPersistentManifold** manifolds, int manifold_count,
                                                            btTypedConstraint** constraints, int constraint_count,
                                                            const btContactSolverInfo& info, btIDebugDraw* drawer) {
  if (rounds_ == Rounds::tree_rows) {
    tree_rows_.start(m_multiBodyNonContactConstraints, m_multiBodyNormalContactConstraints,
                     m_multiBodyFrictionContactConstraints, m_data, m_tmpSolverBodyPool);
  }
  const btScalar result = btMultiBodyConstraintSolver::solveGroupCacheFriendlyIterations(
      bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  if (rounds_ == Rounds::tree_rows) tree_rows_.finish();
  return result;
}

btScalar MultiBodySolver::solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                               btPersistentManifold** manifolds, int manifold_count,
                                               btTypedConstraint** constraints, int constraint_count,
                                               const btContactSolverInfo& info, btIDebugDraw* drawer) {
  if (rounds_ == Rounds::bullet) {
    return btMultiBodyConstraintSolver::solveSingleIteration(iteration, bodies, body_count, manifolds, manifold_count,
                                                             constraints, constraint_count, info, drawer);
  }
  const btScalar of_bodies = btSequentialImpulseConstraintSolver::solveSingleIteration(
      iteration, bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  return std::max(of_bodies, tree_rows_.iterate(iteration, info.m_numNonContactInnerIterations));
}

// The rows have their impulses now, and are gone after it.
btScalar MultiBodySolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                        const btContactSolverInfo& info) {
  if (audit_.before) {
    add_work();
    add_overlap(info);
  }
  return btMultiBodyConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

void MultiBodySolver::add_work() {
  const auto sum = [this](const auto& rows) {
    double work = 0.0;
    for (int i = 0; i < rows.size(); ++i) work += work_of(rows[i]);
    return work;
  };
  audit_.work.contacts += sum(m_tmpSolverContactConstraintPool) + sum(m_multiBodyNormalContactConstraints);
  audit_.work.friction += sum(m_tmpSolverContactFrictionConstraintPool) + sum(m_multiBodyFrictionContactConstraints);
  for (int i = 0; i < m_multiBodyNonContactConstraints.size(); ++i) {
    const btMultiBodySolverConstraint& row = m_multiBodyNonContactConstraints[i];
    if (!is_drive(row)) (is_motor(row) ? audit_.work.motors : audit_.work.joints) += work_of(row);
  }
  audit_.work.motors += sum(m_tmpSolverNonContactConstraintPool);  // joints are of trees alone
}

// Split impulses move bodies and leave their velocities alone.
void MultiBodySolver::add_overlap(const btContactSolverInfo& info) {
  for (int i = 0; i < m_tmpSolverBodyPool.size(); ++i) {
    const btSolverBody& body = m_tmpSolverBodyPool[i];
    if (!body.m_originalBody) continue;  // fixed
    const Motion::OfBody& loaded = audit_.before->bodies[static_cast<std::size_t>(body.m_originalBody->getUserIndex())];
    const btVector3 turn = body.getTurnVelocity() * info.m_splitImpulseTurnErp;
    audit_.work.overlap -= (loaded.force.dot(body.getPushVelocity()) + loaded.torque.dot(turn)) * info.m_timeStep;
  }
}

double MultiBodySolver::work_of(const btSolverConstraint& row) const {
  return row.m_appliedImpulse * (mean_speed(row.m_solverBodyIdA, row.m_contactNormal1, row.m_relpos1CrossNormal) +
                                 mean_speed(row.m_solverBodyIdB, row.m_contactNormal2, row.m_relpos2CrossNormal));
}

double MultiBodySolver::work_of(const btMultiBodySolverConstraint& row) const {
  const double of_a = row.m_multiBodyA
                          ? mean_speed(*row.m_multiBodyA, row.m_jacAindex, row.m_deltaVelAindex)
                          : mean_speed(row.m_solverBodyIdA, row.m_contactNormal1, row.m_relpos1CrossNormal);
  const double of_b = row.m_multiBodyB
                          ? mean_speed(*row.m_multiBodyB, row.m_jacBindex, row.m_deltaVelBindex)
                          : mean_speed(row.m_solverBodyIdB, row.m_contactNormal2, row.m_relpos2CrossNormal);
  return row.m_appliedImpulse * (of_a + of_b);
}

double MultiBodySolver::mean_speed(int solver_body, const btVector3& normal, const btVector3& arm_cross_normal) const {
  if (solver_body < 0) return 0.0;
  const btSolverBody& body = m_tmpSolverBodyPool[solver_body];
  if (!body.m_originalBody) return 0.0;  // fixed
  const Motion::OfBody& before = audit_.before->bodies[static_cast<std::size_t>(body.m_originalBody->getUserIndex())];
  const btVector3 linear = body.m_linearVelocity + body.m_externalForceImpulse + body.m_deltaLinearVelocity;
  const btVector3 angular = body.m_angularVelocity + body.m_externalTorqueImpulse + body.m_deltaAngularVelocity;
  return 0.5 * (normal.dot(before.linear + linear) + arm_cross_normal.dot(before.angular + angular));
}

double MultiBodySolver::mean_speed(const btMultiBody& tree, int jacobian, int changes) const {
  const std::vector<double>& before = audit_.before->trees.at(&tree);
  const btScalar* now = tree.getVelocityVector();
  double speed = 0.0;
  for (int i = 0; i < static_cast<int>(before.size()); ++i) {
    const double after = now[i] + m_data.m_deltaVelocities[changes + i];
    speed += m_data.m_jacobians[jacobian + i] * 0.5 * (before[static_cast<std::size_t>(i)] + after);
  }
  return speed;
}

}  // namespace energymargin

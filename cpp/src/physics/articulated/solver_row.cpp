#include "physics/articulated/solver_row.hpp"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

namespace energymargin {
namespace {

int velocity_of(const JointPlace& joint) { return base_velocities + joint.body->getLink(joint.link).m_dofOffset; }

// Where a tree's changes of velocity stand; Bullet makes room for each tree once a step.
int delta_velocities(btMultiBody& body, btMultiBodyJacobianData& data) {
  if (body.getCompanionId() < 0) {
    body.setCompanionId(data.m_deltaVelocities.size());
    data.m_deltaVelocities.resize(data.m_deltaVelocities.size() + base_velocities + body.getNumDofs());
  }
  return body.getCompanionId();
}

int new_jacobian(const btMultiBody& body, btMultiBodyJacobianData& data) {
  const int first = data.m_jacobians.size();
  const int velocities = base_velocities + body.getNumDofs();
  data.m_jacobians.resize(first + velocities, 0.0);
  data.m_deltaVelocitiesUnitImpulse.resize(first + velocities, 0.0);
  return first;
}

void find_responses(btMultiBody& body, int jacobian, btMultiBodyJacobianData& data) {
  body.calcAccelerationDeltasMultiDof(&data.m_jacobians[jacobian], &data.m_deltaVelocitiesUnitImpulse[jacobian],
                                      data.scratch_r, data.scratch_v);
}

btMultiBodySolverConstraint& empty_row(btMultiBodyConstraint& owner, int number, btMultiBodyConstraintArray& rows) {
  btMultiBodySolverConstraint& row = rows.expandNonInitializing();
  row = btMultiBodySolverConstraint();
  row.m_relpos1CrossNormal.setZero();
  row.m_contactNormal1.setZero();
  row.m_relpos2CrossNormal.setZero();
  row.m_contactNormal2.setZero();
  row.m_appliedImpulse = 0.0;
  row.m_cfm = 0.0;
  row.m_solverBodyIdA = row.m_solverBodyIdB = -1;
  row.m_orgConstraint = &owner;
  row.m_orgDofIndex = number;
  return row;
}

}  // namespace

btMultiBodySolverConstraint& add_base_row(btMultiBodyConstraint& owner, int number, btMultiBodyConstraintArray& rows,
                                          btMultiBodyJacobianData& data, btMultiBody& tree, int velocity) {
  btMultiBodySolverConstraint& row = empty_row(owner, number, rows);
  row.m_multiBodyA = &tree;
  row.m_linkA = -1;
  row.m_multiBodyB = nullptr;
  row.m_deltaVelAindex = delta_velocities(tree, data);
  row.m_jacAindex = new_jacobian(tree, data);
  data.m_jacobians[row.m_jacAindex + velocity] = 1.0;
  find_responses(tree, row.m_jacAindex, data);
  row.m_jacDiagABInv = 1.0 / data.m_deltaVelocitiesUnitImpulse[row.m_jacAindex + velocity];
  return row;
}

btMultiBodySolverConstraint& add_row(btMultiBodyConstraint& owner, int number, btMultiBodyConstraintArray& rows,
                                     btMultiBodyJacobianData& data, const JointShare& a,
                                     const std::optional<JointShare>& b) {
  btMultiBodySolverConstraint& row = empty_row(owner, number, rows);
  const bool two_trees = b && b->joint.body != a.joint.body;
  row.m_multiBodyA = a.joint.body;
  row.m_linkA = a.joint.link;
  row.m_deltaVelAindex = delta_velocities(*a.joint.body, data);
  row.m_jacAindex = new_jacobian(*a.joint.body, data);
  row.m_multiBodyB = two_trees ? b->joint.body : nullptr;
  if (two_trees) {
    row.m_linkB = b->joint.link;
    row.m_deltaVelBindex = delta_velocities(*b->joint.body, data);
    row.m_jacBindex = new_jacobian(*b->joint.body, data);
  }
  const int at_a = row.m_jacAindex + velocity_of(a.joint);
  const int at_b = b ? (two_trees ? row.m_jacBindex : row.m_jacAindex) + velocity_of(b->joint) : 0;
  data.m_jacobians[at_a] = a.share;
  if (b) data.m_jacobians[at_b] = b->share;
  find_responses(*a.joint.body, row.m_jacAindex, data);
  if (two_trees) find_responses(*b->joint.body, row.m_jacBindex, data);
  double response = a.share * data.m_deltaVelocitiesUnitImpulse[at_a];
  if (b) response += b->share * data.m_deltaVelocitiesUnitImpulse[at_b];
  row.m_jacDiagABInv = 1.0 / response;
  return row;
}

int island_of(const JointPlace& joint) { return joint.body->getLink(joint.link).m_collider->getIslandTag(); }

}  // namespace energymargin

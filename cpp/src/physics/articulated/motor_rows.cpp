#include "physics/articulated/motor_rows.hpp"

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace energymargin {
namespace {

constexpr int axes = 3;

// Along axes that are locked there is nothing to push.
bool pushes(const btRigidBody& body, int row) {
  return row < axes ? body.getLinearFactor()[row] != 0.0 : body.getAngularFactor()[row - axes] != 0.0;
}

}  // namespace

void RigidMotor::getInfo1(btConstraintInfo1* info) {
  info->m_numConstraintRows = 0;
  for (int row = 0; row < 2 * axes; ++row) info->m_numConstraintRows += pushes(getRigidBodyA(), row) ? 1 : 0;
  info->nub = 0;
}

void RigidMotor::getInfo2(btConstraintInfo2* info) {
  int at = 0;
  for (int row = 0; row < 2 * axes; ++row) {
    if (!pushes(getRigidBodyA(), row)) continue;
    const bool turns = row >= axes;
    const int axis = row % axes;
    (turns ? info->m_J1angularAxis : info->m_J1linearAxis)[at + axis] = 1.0;
    const int entry = at;
    info->m_constraintError[entry] = turns ? motor_.angular[axis] : motor_.linear[axis];
    const double most = (turns ? motor_.torque : motor_.force) / info->fps;
    info->m_lowerLimit[entry] = -most;
    info->m_upperLimit[entry] = most;
    at += info->rowskip;
  }
}

BaseMotor::BaseMotor(btMultiBody& tree, const Motor& motor)
    : btMultiBodyConstraint(&tree, nullptr, -1, -1, 2 * axes, false, MULTIBODY_CONSTRAINT_SPHERICAL_MOTOR),
      motor_(motor) {
  allocateJacobiansMultiDof();
}

void BaseMotor::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                     const btContactSolverInfo& info) {
  for (int i = 0; i < 2 * axes; ++i) {
    const bool turns = i < axes;  // a tree's velocities begin with the turning of its base
    const int axis = i % axes;
    btMultiBodySolverConstraint& row = add_base_row(*this, i, rows, data, *m_bodyA, i);
    const double now = m_bodyA->getVelocityVector()[i];
    const double change = (turns ? motor_.angular[axis] : motor_.linear[axis]) - now;
    const double most = (turns ? motor_.torque : motor_.force) * info.m_timeStep;
    row.m_rhs = change * row.m_jacDiagABInv;
    row.m_lowerLimit = -most;
    row.m_upperLimit = most;
  }
}

bool is_motor(const btMultiBodySolverConstraint& row) {
  return row.m_orgConstraint->getConstraintType() == MULTIBODY_CONSTRAINT_SPHERICAL_MOTOR;
}

}  // namespace energymargin

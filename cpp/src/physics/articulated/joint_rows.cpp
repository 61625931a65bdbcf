#include "physics/articulated/joint_rows.hpp"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace energymargin {
namespace {

constexpr double stop_reach = 0.05;  // a stop takes part from this gap on [rad or m] ...
constexpr double stop_steps = 4.0;   // ... or if the joint gets there in so many steps
enum Row { drive_row, lower_row, upper_row, rows_of_a_joint };

}  // namespace

JointRows::JointRows(btMultiBody& body, int link, const Joint& joint)
    : btMultiBodyConstraint(&body, nullptr, link, -1, rows_of_a_joint, false, MULTIBODY_CONSTRAINT_1DOF_JOINT_MOTOR),
      joint_(joint) {
  allocateJacobiansMultiDof();
  forget();
}

void JointRows::forget() {
  for (int row = 0; row < rows_of_a_joint; ++row) internalSetAppliedImpulse(row, 0.0);
}

int JointRows::getIslandIdA() const { return island_of(place()); }

void JointRows::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                     const btContactSolverInfo& info) {
  const double step = info.m_timeStep;
  if (joint_.stiffness > 0.0 || joint_.damping > 0.0) add_drive(rows, data, step);
  const double position = m_bodyA->getJointPos(m_linkA);
  const double reach = std::max(stop_reach, stop_steps * step * fastest_joint());
  if (position - joint_.lower < reach) add_stop(rows, data, step, 1.0, position - joint_.lower);
  if (joint_.upper - position < reach) add_stop(rows, data, step, -1.0, joint_.upper - position);
}

// A joint that hits its stop speeds up its neighbours within the same step.
double JointRows::fastest_joint() const {
  const btScalar* velocities = m_bodyA->getVelocityVector() + base_velocities;
  return std::accumulate(velocities, velocities + m_bodyA->getNumDofs(), 0.0,
                         [](double most, double velocity) { return std::max(most, std::abs(velocity)); });
}

// The impulse is that of the spring and damper at the end of the step:
// p = h (k (target - q - h v) + d (v_target - v)), which is a row of softness 1 / (h (h k + d)).
void JointRows::add_drive(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step) {
  btMultiBodySolverConstraint& row = add_row(*this, drive_row, rows, data, {place(), 1.0});
  const double inverse_inertia = 1.0 / row.m_jacDiagABInv;
  const double gain = step * joint_.stiffness + joint_.damping;
  const double softness = 1.0 / (step * gain);
  const double target_velocity =
      (joint_.stiffness * (joint_.target - m_bodyA->getJointPos(m_linkA)) + joint_.damping * joint_.target_velocity) /
      gain;
  row.m_jacDiagABInv = 1.0 / (inverse_inertia + softness);
  row.m_cfm = softness * row.m_jacDiagABInv;
  row.m_rhs = (target_velocity - m_bodyA->getJointVel(m_linkA)) * row.m_jacDiagABInv;
  row.m_upperLimit = std::min(joint_.torque_limit * step, no_impulse_limit);
  row.m_lowerLimit = -row.m_upperLimit;
}

// The joint may not cross its stop in this step; beyond it, it may not go on. Bringing it back would speed it up.
void JointRows::add_stop(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step, double direction,
                         double gap) {
  btMultiBodySolverConstraint& row =
      add_row(*this, direction > 0.0 ? lower_row : upper_row, rows, data, {place(), direction});
  const double least = -std::max(gap, 0.0) / step;
  row.m_rhs = (least - direction * m_bodyA->getJointVel(m_linkA)) * row.m_jacDiagABInv;
  row.m_lowerLimit = 0.0;
  row.m_upperLimit = no_impulse_limit;
}

bool is_drive(const btMultiBodySolverConstraint& row) {
  return row.m_orgConstraint->getConstraintType() == MULTIBODY_CONSTRAINT_1DOF_JOINT_MOTOR &&
         row.m_orgDofIndex == drive_row;
}

}  // namespace energymargin

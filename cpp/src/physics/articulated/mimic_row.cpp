#include "physics/articulated/mimic_row.hpp"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace energymargin {

MimicRow::MimicRow(const JointPlace& follower, const JointPlace& followed, const Mimic& mimic)
    : btMultiBodyConstraint(follower.body, followed.body, follower.link, followed.link, 1, false,
                            MULTIBODY_CONSTRAINT_GEAR),
      follower_(follower),
      followed_(followed),
      mimic_(mimic) {
  allocateJacobiansMultiDof();
  forget();
}

void MimicRow::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                    const btContactSolverInfo& info) {
  const auto position = [](const JointPlace& joint) { return joint.body->getJointPos(joint.link); };
  const auto velocity = [](const JointPlace& joint) { return joint.body->getJointVel(joint.link); };
  btMultiBodySolverConstraint& row =
      add_row(*this, 0, rows, data, {follower_, 1.0}, JointShare{followed_, -mimic_.multiplier});
  const double error = position(follower_) - mimic_.multiplier * position(followed_) - mimic_.offset;
  const double error_rate = velocity(follower_) - mimic_.multiplier * velocity(followed_);
  row.m_rhs = -(error_rate + info.m_erp2 * error / info.m_timeStep) * row.m_jacDiagABInv;
  row.m_lowerLimit = -no_impulse_limit;
  row.m_upperLimit = no_impulse_limit;
}

}  // namespace energymargin

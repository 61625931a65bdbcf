#pragma once
// A joint's drive and limits as rows of Bullet's constraint solver.

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>

#include "energymargin/scene.hpp"

namespace energymargin {

//! Position control with compliance as an implicit spring and damper, stable for any stiffness, within its torque
//! limit; and the joint's stops, where it is near them.
class JointRows : public btMultiBodyConstraint {
 public:
  JointRows(btMultiBody& body, int link, const Joint& joint);

  void set_target(double target) { joint_.target = target; }

  void finalizeMultiDof() override {}
  int getIslandIdA() const override;
  int getIslandIdB() const override { return -1; }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw*) override {}

 private:
  void add_drive(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step) const;
  void add_stop(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step, double direction,
                double gap) const;
  btMultiBodySolverConstraint& add_row(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                       double direction) const;

  Joint joint_;
};

}  // namespace energymargin

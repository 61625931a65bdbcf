#pragma once
// A joint's drive and limits as rows of Bullet's constraint solver.

#include "energymargin/scene.hpp"
#include "physics/articulated/solver_row.hpp"

namespace energymargin {

//! Position control with compliance as an implicit spring and damper, stable for any stiffness, within its torque
//! limit; and the joint's stops, where it is near them.
class JointRows : public btMultiBodyConstraint {
 public:
  JointRows(btMultiBody& body, int link, const Joint& joint);

  //! Starts anew: the solver goes on from the last step's impulses.
  void forget();

  void set_target(double target) { joint_.target = target; }
  double target() const { return joint_.target; }

  void finalizeMultiDof() override {}
  int getIslandIdA() const override;
  int getIslandIdB() const override { return -1; }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw*) override {}

 private:
  double fastest_joint() const;
  void add_drive(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step);
  void add_stop(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data, double step, double direction,
                double gap);
  JointPlace place() const { return {m_bodyA, m_linkA}; }

  Joint joint_;
};

//! Whether a row is that of a joint's drive; otherwise it is a stop's or a mimic's.
bool is_drive(const btMultiBodySolverConstraint& row);

}  // namespace energymargin

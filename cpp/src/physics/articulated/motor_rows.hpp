#pragma once
// Motors as rows of Bullet's constraint solvers.

#include <btBulletDynamicsCommon.h>

#include "physics/articulated/solver_row.hpp"
#include "physics/load.hpp"

namespace energymargin {

//! Of a rigid body.
class RigidMotor : public btTypedConstraint {
 public:
  RigidMotor(btRigidBody& body, const Motor& motor) : btTypedConstraint(CONTACT_CONSTRAINT_TYPE, body), motor_(motor) {}

  void getInfo1(btConstraintInfo1* info) override;
  void getInfo2(btConstraintInfo2* info) override;
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0.0; }

 private:
  Motor motor_;
};

//! Of the free base of a tree.
class BaseMotor : public btMultiBodyConstraint {
 public:
  BaseMotor(btMultiBody& tree, const Motor& motor);

  void finalizeMultiDof() override {}
  int getIslandIdA() const override { return -1; }
  int getIslandIdB() const override { return -1; }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw*) override {}

 private:
  Motor motor_;
};

//! Whether a row is that of a base's motor.
bool is_motor(const btMultiBodySolverConstraint& row);

}  // namespace energymargin

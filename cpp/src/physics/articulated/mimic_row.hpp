#pragma once
// A joint that follows another one, as a row of Bullet's constraint solver.

#include "energymargin/scene.hpp"
#include "physics/articulated/solver_row.hpp"

namespace energymargin {

//! Keeps position - multiplier * followed position at the offset, as a linkage without play does.
class MimicRow : public btMultiBodyConstraint {
 public:
  MimicRow(const JointPlace& follower, const JointPlace& followed, const Mimic& mimic);

  //! Starts anew: the solver goes on from the last step's impulse.
  void forget() { internalSetAppliedImpulse(0, 0.0); }

  void finalizeMultiDof() override {}
  int getIslandIdA() const override { return island_of(follower_); }
  int getIslandIdB() const override { return island_of(followed_); }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw*) override {}

 private:
  JointPlace follower_, followed_;
  Mimic mimic_;
};

}  // namespace energymargin

#pragma once
// Rows of Bullet's constraint solver that act on joints.

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>

#include <optional>

namespace energymargin {

//! Impulse limit of a row that has none [N m s].
inline constexpr double no_impulse_limit = 1e10;

//! A tree's velocities begin with those of its base.
inline constexpr int base_velocities = 6;

//! Where a joint is among Bullet's.
struct JointPlace {
  btMultiBody* body;
  int link;
};

//! What one joint has to do with a row: the row's velocity is the sum of share * joint velocity.
struct JointShare {
  JointPlace joint;
  double share;
};

//! Adds row `number` of `owner`, over one joint or over two, on one tree or on two. It has neither target nor limits
//! yet; its m_jacDiagABInv is the inverse of the velocity that a unit impulse gives.
btMultiBodySolverConstraint& add_row(btMultiBodyConstraint& owner, int number, btMultiBodyConstraintArray& rows,
                                     btMultiBodyJacobianData& data, const JointShare& a,
                                     const std::optional<JointShare>& b = std::nullopt);

//! Adds row `number` of `owner` over one of the six velocities of a tree's free base, by its place among the tree's.
btMultiBodySolverConstraint& add_base_row(btMultiBodyConstraint& owner, int number, btMultiBodyConstraintArray& rows,
                                          btMultiBodyJacobianData& data, btMultiBody& tree, int velocity);

//! Bullet's number of the island that a joint's link is in.
int island_of(const JointPlace& joint);

}  // namespace energymargin

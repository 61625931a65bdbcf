#pragma once
// The step of a scene with joints.

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "physics/articulated/motor_rows.hpp"
#include "physics/articulated/watched_solver.hpp"
#include "physics/free_bodies/rigid_motions.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Links on joints, free and fixed bodies. One step does what Bullet's world does in one, with all constraints in one
//! group and contacts in the order of their bodies in the scene. Bullet's world splits them into islands, and which
//! comes first depends on pairs that were near each other in the past.
class ArticulatedBodies : public Stepper {
 public:
  //! Of the trees and joints' constraints of `world`, which has them all by now.
  ArticulatedBodies(btCollisionDispatcher& dispatcher, WatchedSolver& solver, btMultiBodyDynamicsWorld& world);

  void add(btRigidBody& moving);

  //! A link's, or that of a tree's free base.
  void add(btMultiBodyLinkCollider& collider);

  void keep() override;
  void undo() override;
  void undo_split_impulses() override { kept_.undo_split_impulses(rigids_); }
  void solve(double duration, btContactSolverInfo& info) override;
  void read(std::vector<Velocity>& velocities) const override;
  void move(double duration, double share) override;

 private:
  void set_up_motors();

  WatchedSolver& solver_;
  btMultiBodyDynamicsWorld& world_;
  std::vector<btMultiBody*> trees_;
  std::vector<btMultiBodyConstraint*> constraints_;  // of the joints, and for a step those of motors
  std::size_t of_joints_;
  std::vector<std::unique_ptr<BaseMotor>> base_motors_;
  std::vector<std::unique_ptr<RigidMotor>> rigid_motors_;
  std::vector<btTypedConstraint*> of_rigids_;
  std::vector<btRigidBody*> rigids_;
  std::vector<btMultiBodyLinkCollider*> colliders_;
  std::vector<btCollisionObject*> moving_;
  RigidMotions kept_;
  std::vector<std::vector<double>> kept_velocities_;  // of the trees: base, then joints
  // Scratch of Bullet's.
  btAlignedObjectArray<btScalar> numbers_;
  btAlignedObjectArray<btVector3> vectors_, origins_;
  btAlignedObjectArray<btMatrix3x3> matrices_;
  btAlignedObjectArray<btQuaternion> rotations_;
  mutable std::vector<btVector3> turning_, moving_links_;
};

}  // namespace energymargin

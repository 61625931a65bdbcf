#pragma once
// The step of a scene with joints.

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "physics/articulated/articulation.hpp"
#include "physics/articulated/mimic_row.hpp"
#include "physics/articulated/motor_rows.hpp"
#include "physics/articulated/multi_body_solver.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Links on joints, free and fixed bodies. One step does what Bullet's world does in one, with all constraints in one
//! group and contacts in the order of their bodies in the scene. Bullet's world splits them into islands, and which
//! comes first depends on pairs that were near each other in the past.
class ArticulatedBodies : public Stepper {
 public:
  //! Both outlive this.
  ArticulatedBodies(const Scene& scene, const std::vector<CollisionShape>& shapes);

  const RigidBodies& rigids() const { return rigids_; }
  const std::vector<std::unique_ptr<Articulation>>& trees() const { return trees_; }

  //! The rows of the joints and mimics.
  const std::vector<btMultiBodyConstraint*>& constraints() const { return constraints_; }

  const std::vector<btRigidBody*>& objects() const override { return rigids_.objects(); }
  void restore(const State& state) override;
  void read(State& state) const override;
  void read(std::vector<Velocity>& velocities) const override;
  void read(Motion& motion) const override;
  btVector3 velocity(std::size_t body, const btVector3& point) const override;
  void apply(const Load& load, double duration) override;
  void accelerate(double duration) override;
  void set_target(std::size_t joint, double target) override;
  double target(std::size_t joint) const override;
  void save() override;
  void undo() override;
  void undo_split_impulses() override { rigids_.undo_split_impulses(); }
  void solve(const StepPart& part) override;
  void move(double duration, double share) override;

 private:
  void add_trees(const std::vector<CollisionShape>& shapes);
  void add_mimics();
  void add_motors(const std::vector<Motor>& motors);
  Articulation& articulation(std::size_t body) const { return *trees_[*tree_of_[body]]; }
  btMultiBodyLinkCollider& link(std::size_t body) const;
  btRigidBody& rigid(std::size_t body) const;

  const Scene& scene_;
  RigidBodies rigids_;
  std::vector<std::unique_ptr<Articulation>> trees_;
  std::vector<std::optional<std::size_t>> tree_of_;  // index of the tree that a body is in
  std::vector<Load> link_loads_;                     // constant forces on bodies of trees
  std::vector<std::unique_ptr<MimicRow>> mimics_;
  MultiBodySolver solver_;
  std::vector<btMultiBodyConstraint*> constraints_;         // of the joints and mimics
  std::vector<btMultiBodyConstraint*> solver_constraints_;  // these and, in a part of a step, the motors'
  std::vector<std::unique_ptr<BaseMotor>> base_motors_;
  std::vector<std::unique_ptr<RigidMotor>> rigid_motors_;
  std::vector<btTypedConstraint*> rigid_constraints_;
  std::vector<btCollisionObject*> moving_;             // rigid bodies, then links
  std::vector<std::vector<double>> saved_velocities_;  // of the trees: base, then joints
  // Scratch of Bullet's.
  btAlignedObjectArray<btScalar> numbers_;
  btAlignedObjectArray<btVector3> vectors_, origins_;
  btAlignedObjectArray<btMatrix3x3> matrices_;
  btAlignedObjectArray<btQuaternion> rotations_;
};

}  // namespace energymargin

#pragma once
// The step of a scene with joints.

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "physics/articulated/articulated_solver.hpp"
#include "physics/articulated/articulation.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Links on joints, free and fixed bodies. All constraints are solved in one group, contacts in the order of their
//! bodies in the scene.
class ArticulatedBodies : public Stepper {
 public:
  //! Both outlive this.
  ArticulatedBodies(const Scene& scene, const std::vector<CollisionShape>& shapes);

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
  bool solve(const StepPart& part) override;
  void move(double duration, double share) override;

 private:
  void add_trees(const std::vector<CollisionShape>& shapes);
  void add_mimics();
  Articulation& articulation(std::size_t body) const { return *trees_[*tree_of_[body]]; }
  JointControl* control_of(std::size_t joint) const;  // null for one without
  btRigidBody& rigid(std::size_t body) const;

  const Scene& scene_;
  RigidBodies rigids_;
  std::vector<std::unique_ptr<Articulation>> trees_;
  std::vector<std::optional<std::size_t>> tree_of_;  // index of the tree that a body is in
  std::vector<Load> link_loads_;                     // constant forces on bodies of trees
  std::vector<MimicConstraint> mimics_;
  std::optional<ArticulatedSolver> solver_;
  std::vector<std::vector<double>> saved_velocities_;  // of the trees
};

}  // namespace energymargin

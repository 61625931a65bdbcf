#include "physics/articulated/articulated_bodies.hpp"

#include <stdexcept>

namespace energymargin {

ArticulatedBodies::ArticulatedBodies(const Scene& scene, const std::vector<CollisionShape>& shapes)
    : scene_(scene), rigids_(scene, shapes), tree_of_(scene.bodies().size()), solver_(impulses_) {
  colliders_.resize(scene.bodies().size());
  for (const auto& body : rigids_.all()) colliders_[body_index(*body)] = body.get();
  moving_.assign(rigids_.moving().begin(), rigids_.moving().end());
  add_trees(shapes);
  add_mimics();
  saved_velocities_.resize(trees_.size());
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Vector3& force = scene.bodies()[i].force;
    if (tree_of_[i] && !force.isZero(0.0)) link_loads_.push_back({i, to_bullet(force), btVector3(0, 0, 0)});
  }
}

// What hangs on a free body is one tree; on a fixed body each child starts a tree of its own, so that two robots on one
// table know nothing of each other.
void ArticulatedBodies::add_trees(const std::vector<CollisionShape>& shapes) {
  const auto add = [&](std::size_t base, std::optional<std::size_t> first) {
    trees_.push_back(std::make_unique<Articulation>(scene_, shapes, base, first));
    for (const auto& collider : trees_.back()->colliders()) {
      const auto body = body_index(*collider);
      colliders_[body] = collider.get();
      tree_of_[body] = trees_.size() - 1;
      moving_.push_back(collider.get());
    }
    for (btMultiBodyConstraint* row : trees_.back()->constraints()) constraints_.push_back(row);
  };
  for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
    const std::size_t parent = scene_.index(scene_.joints()[i].parent);
    if (scene_.bodies()[parent].fixed()) {
      add(parent, i);
    } else if (!scene_.joint_to(parent) && !tree_of_[parent]) {
      add(parent, std::nullopt);
    }
  }
}

// A joint and the one that it follows may be on two trees.
void ArticulatedBodies::add_mimics() {
  const auto place_of = [this](std::size_t joint) -> JointPlace {
    for (const auto& tree : trees_) {
      if (const auto place = tree->place_of(joint)) return *place;
    }
    throw std::logic_error("a joint that is on no tree");
  };
  for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
    const auto& mimic = scene_.joints()[i].mimic;
    if (!mimic) continue;
    const std::size_t followed = scene_.joint_index(mimic->joint);
    if (scene_.joints()[followed].held) continue;  // then both are rigid
    mimics_.push_back(std::make_unique<MimicRow>(place_of(i), place_of(followed), *mimic));
    constraints_.push_back(mimics_.back().get());
  }
}

btMultiBodyLinkCollider& ArticulatedBodies::link(std::size_t body) const {
  return static_cast<btMultiBodyLinkCollider&>(*colliders_[body]);
}

btRigidBody& ArticulatedBodies::rigid(std::size_t body) const { return static_cast<btRigidBody&>(*colliders_[body]); }

void ArticulatedBodies::restore(const State& state) {
  rigids_.restore(state);
  for (const auto& tree : trees_) tree->restore(state);
  for (const auto& mimic : mimics_) mimic->forget();
  solver_.reset();
}

void ArticulatedBodies::read(State& state) const {
  rigids_.read(state);
  for (const auto& tree : trees_) tree->read(state);
}

void ArticulatedBodies::read(std::vector<Velocity>& velocities) const {
  rigids_.read(velocities);
  for (const auto& tree : trees_) tree->read(velocities);
}

void ArticulatedBodies::read(Motion& motion) const {
  rigids_.read(motion);
  for (const auto& tree : trees_) tree->read(motion);
}

btVector3 ArticulatedBodies::velocity(std::size_t body, const btVector3& point) const {
  return tree_of_[body] ? articulation(body).velocity(link(body), point) : velocity_at(rigid(body), point);
}

void ArticulatedBodies::apply(const Load& load, double duration) {
  if (tree_of_[load.body]) {
    articulation(load.body).apply(link(load.body), load.force, load.torque);
  } else {
    apply_load(rigid(load.body), load, duration);
  }
}

// The trees' gravity comes with `solve`.
void ArticulatedBodies::accelerate(double duration) {
  rigids_.accelerate(duration);
  for (const Load& load : link_loads_) apply(load, duration);
}

void ArticulatedBodies::set_target(std::size_t joint, double target) {
  for (const auto& tree : trees_) tree->set_target(joint, target);
}

double ArticulatedBodies::target(std::size_t joint) const {
  for (const auto& tree : trees_) {
    if (const auto target = tree->target(joint)) return *target;
  }
  return scene_.joints()[joint].target;
}

void ArticulatedBodies::save() {
  rigids_.save();
  for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i]->read_velocities(saved_velocities_[i]);
}

void ArticulatedBodies::undo() {
  rigids_.undo();
  for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i]->restore_velocities(saved_velocities_[i]);
}

void ArticulatedBodies::solve(const StepPart& part) {
  const btContactSolverInfo& info = part.solver;
  const btVector3 gravity = to_bullet(scene_.gravity());
  for (const auto& articulation : trees_) {
    btMultiBody& tree = articulation->multi_body();
    tree.forwardKinematics(rotations_, origins_);
    tree.clearConstraintForces();
    tree.addBaseForce(gravity * tree.getBaseMass());
    for (int i = 0; i < tree.getNumLinks(); ++i) tree.addLinkForce(i, gravity * tree.getLinkMass(i));
    tree.computeAccelerationsArticulatedBodyAlgorithmMultiDof(part.duration, numbers_, vectors_, matrices_, false,
                                                              info.m_jointFeedbackInWorldSpace,
                                                              info.m_jointFeedbackInJointFrame);
  }
  add_motors(part.motors);
  std::vector<btPersistentManifold*> touching = part.touching;
  solver_.solveMultiBodyGroup(moving_.data(), static_cast<int>(moving_.size()), touching.data(),
                              static_cast<int>(touching.size()), rigid_constraints_.data(),
                              static_cast<int>(rigid_constraints_.size()), solver_constraints_.data(),
                              static_cast<int>(solver_constraints_.size()), info, nullptr, nullptr);
  for (const auto& articulation : trees_) articulation->multi_body().processDeltaVeeMultiDof2();
}

void ArticulatedBodies::add_motors(const std::vector<Motor>& motors) {
  solver_constraints_ = constraints_;
  base_motors_.clear();
  rigid_motors_.clear();
  rigid_constraints_.clear();
  for (const Motor& motor : motors) {
    if (tree_of_[motor.body]) {
      base_motors_.push_back(std::make_unique<BaseMotor>(articulation(motor.body).multi_body(), motor));
      solver_constraints_.push_back(base_motors_.back().get());
    } else {
      rigid_motors_.push_back(std::make_unique<RigidMotor>(rigid(motor.body), motor));
      rigid_constraints_.push_back(rigid_motors_.back().get());
    }
  }
}

void ArticulatedBodies::move(double duration, double share) {
  rigids_.move(duration, share);
  for (const auto& articulation : trees_) {
    btMultiBody& tree = articulation->multi_body();
    tree.stepPositionsMultiDof(share * duration);
    tree.updateCollisionObjectWorldTransforms(rotations_, origins_);
    tree.clearForcesAndTorques();
  }
}

}  // namespace energymargin

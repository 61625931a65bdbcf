#include "physics/articulated/articulated_bodies.hpp"

#include <stdexcept>

namespace energymargin {

ArticulatedBodies::ArticulatedBodies(const Scene& scene, const std::vector<CollisionShape>& shapes)
    : scene_(scene), rigids_(scene, shapes), tree_of_(scene.bodies().size()) {
  colliders_.resize(scene.bodies().size());
  for (const auto& body : rigids_.all()) colliders_[body_index(*body)] = body.get();
  add_trees(shapes);
  add_mimics();
  std::vector<Articulation*> trees;
  for (const auto& tree : trees_) trees.push_back(tree.get());
  solver_.emplace(rigids_.moving(), trees, mimics_, impulses_);
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
    }
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
  const auto end = [this](std::size_t joint) -> MimicConstraint::End {
    for (std::size_t tree = 0; tree < trees_.size(); ++tree) {
      if (const auto link = trees_[tree]->link_on(joint)) return {tree, *link};
    }
    throw std::logic_error("a joint that is on no tree");
  };
  for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
    const auto& mimic = scene_.joints()[i].mimic;
    if (!mimic) continue;
    const std::size_t followed = scene_.joint_index(mimic->joint);
    if (scene_.joints()[followed].held) continue;  // then both are rigid
    mimics_.push_back({end(i), end(followed), *mimic});
  }
}

btRigidBody& ArticulatedBodies::rigid(std::size_t body) const { return static_cast<btRigidBody&>(*colliders_[body]); }

void ArticulatedBodies::restore(const State& state) {
  rigids_.restore(state);
  for (const auto& tree : trees_) tree->restore(state);
  for (MimicConstraint& mimic : mimics_) mimic.impulse = 0.0;
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
  motion.trees.clear();
  for (const auto& tree : trees_) motion.trees.push_back(tree->velocities());
}

btVector3 ArticulatedBodies::velocity(std::size_t body, const btVector3& point) const {
  return tree_of_[body] ? articulation(body).velocity(*colliders_[body], point) : velocity_at(rigid(body), point);
}

void ArticulatedBodies::apply(const Load& load, double duration) {
  if (tree_of_[load.body]) {
    articulation(load.body).apply(*colliders_[load.body], load.force, load.torque);
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
  if (JointControl* control = control_of(joint)) control->target = target;
}

double ArticulatedBodies::target(std::size_t joint) const {
  const JointControl* control = control_of(joint);
  return control ? control->target : scene_.joints()[joint].target;
}

JointControl* ArticulatedBodies::control_of(std::size_t joint) const {
  for (const auto& tree : trees_) {
    for (JointControl& control : tree->controls()) {
      if (control.joint == &scene_.joints()[joint]) return &control;
    }
  }
  return nullptr;
}

void ArticulatedBodies::save() {
  rigids_.save();
  for (std::size_t i = 0; i < trees_.size(); ++i) saved_velocities_[i] = trees_[i]->velocities();
}

void ArticulatedBodies::undo() {
  rigids_.undo();
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    trees_[i]->velocities() = saved_velocities_[i];
    trees_[i]->clear_loads();
  }
}

bool ArticulatedBodies::solve(const StepPart& part) { return solver_->solve(part, to_bullet(scene_.gravity())); }

void ArticulatedBodies::move(double duration, double share) {
  rigids_.move(duration, share);
  for (const auto& tree : trees_) tree->move(duration, share);
}

}  // namespace energymargin

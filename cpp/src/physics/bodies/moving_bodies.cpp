#include "physics/bodies/moving_bodies.hpp"

#include <stdexcept>

#include "physics/sweep.hpp"

namespace energymargin {

MovingBodies::MovingBodies(const Scene& scene)
    : scene_(scene), rigids_(scene), colliders_(scene.bodies().size()), tree_of_(scene.bodies().size()) {
  for (const auto& body : rigids_.all()) colliders_[body_index(*body)] = body.get();
  add_trees();
  add_mimics();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Vector3& force = scene.bodies()[i].force;
    if (tree_of_[i] && !force.isZero(0.0)) link_loads_.push_back({i, to_bullet(force), btVector3(0, 0, 0)});
  }
}

// What hangs on a free body is one tree; on a fixed body each child starts a tree of its own, so that two robots on one
// table know nothing of each other.
void MovingBodies::add_trees() {
  const auto add = [&](std::size_t base, std::optional<std::size_t> first) {
    trees_.push_back(std::make_unique<Articulation>(scene_, base, first));
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
void MovingBodies::add_mimics() {
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

void MovingBodies::restore(const State& state) {
  rigids_.restore(state);
  for (const auto& tree : trees_) tree->restore(state);
}

void MovingBodies::read(State& state) const {
  rigids_.read(state);
  for (const auto& tree : trees_) tree->read(state);
}

void MovingBodies::read(std::vector<Velocity>& velocities) const {
  rigids_.read(velocities);
  for (const auto& tree : trees_) tree->read(tree->velocities(), velocities);
}

void MovingBodies::read_ways(std::vector<Velocity>& velocities) const {
  rigids_.read_ways(velocities);
  for (const auto& tree : trees_) tree->read(tree->ways(), velocities);
}

void MovingBodies::read(Motion& motion) const {
  rigids_.read(motion);
  motion.trees.clear();
  for (const auto& tree : trees_) motion.trees.push_back(tree->velocities());
}

btVector3 MovingBodies::velocity(std::size_t body, const btVector3& point) const {
  if (tree_of_[body]) {
    const Articulation& tree = *trees_[*tree_of_[body]];
    return tree.velocity(*colliders_[body], point, tree.velocities());
  }
  const auto& rigid = static_cast<const btRigidBody&>(*colliders_[body]);
  return rigid.getVelocityInLocalPoint(point - rigid.getCenterOfMassPosition());
}

void MovingBodies::clear_loads() {
  rigids_.clear_loads();
  for (const auto& tree : trees_) tree->clear_loads();
  for (const Load& load : link_loads_) apply(load);
}

void MovingBodies::apply(const Load& load) {
  if (tree_of_[load.body]) {
    trees_[*tree_of_[load.body]]->apply(*colliders_[load.body], load.force, load.torque);
  } else {
    rigids_.apply(load);
  }
}

void MovingBodies::set_target(std::size_t joint, double target) {
  if (JointControl* control = control_of(joint)) control->target = target;
}

double MovingBodies::target(std::size_t joint) const {
  const JointControl* control = control_of(joint);
  return control ? control->target : scene_.joints()[joint].target;
}

JointControl* MovingBodies::control_of(std::size_t joint) const {
  for (const auto& tree : trees_) {
    for (JointControl& control : tree->controls()) {
      if (control.joint == &scene_.joints()[joint]) return &control;
    }
  }
  return nullptr;
}

std::size_t MovingBodies::base_of(std::size_t body) const {
  return tree_of_[body] ? trees_[*tree_of_[body]]->base() : body;
}

void MovingBodies::carry(std::size_t base, const Velocity& carrier, const btVector3& origin, double duration) {
  const auto carried = [&](const btTransform& pose) {
    const btVector3 linear = carrier.linear + carrier.angular.cross(pose.getOrigin() - origin);
    return moved_pose(pose, linear * duration, carrier.angular * duration);
  };
  if (tree_of_[base]) {
    Articulation& tree = *trees_[*tree_of_[base]];
    tree.put_base(carried(tree.links().front().pose));
  } else {
    auto& rigid = static_cast<btRigidBody&>(*colliders_[base]);
    rigid.setCenterOfMassTransform(carried(rigid.getWorldTransform()));
  }
}

void MovingBodies::move(double duration, double share) {
  rigids_.move(duration, share);
  for (const auto& tree : trees_) tree->move(duration, share);
}

}  // namespace energymargin

#include "articulation.hpp"

#include "shapes.hpp"

namespace energymargin {
namespace {

// Bullet would cut joint velocities off in silence [rad/s or m/s].
constexpr double no_velocity_limit = 1e9;

}  // namespace

Articulation::Articulation(const Scene& scene, const std::vector<std::unique_ptr<btCollisionShape>>& shapes,
                           std::size_t base, std::optional<std::size_t> first, btMultiBodyDynamicsWorld& world)
    : scene_(scene), layout_(scene), base_(base), world_(world) {
  const Body& root = scene.bodies()[base];
  std::vector<MassProperties> masses;
  for (const Body& body : scene.bodies()) {
    masses.push_back(mass_properties(body.shape, body.mass));
    axes_.push_back(body.fixed() ? Quaternion::Identity() : masses.back().axes);
  }
  find_links(base, -1, first);
  body_ = std::make_unique<btMultiBody>(static_cast<int>(links_.size()), root.mass, to_bullet(masses[base].inertia),
                                        root.fixed(), false);
  body_->setLinearDamping(0.0);
  body_->setAngularDamping(0.0);
  body_->setMaxCoordinateVelocity(no_velocity_limit);
  body_->setBaseWorldTransform(
      btTransform(to_bullet(Quaternion(root.state.orientation * axes_[base])), to_bullet(root.state.position)));
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) set_up(i, masses);
  body_->finalizeMultiDof();
  if (!root.fixed()) add_collider(*shapes[base], base, -1);
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    const Joint& joint = scene.joints()[link.joint];
    const std::size_t child = scene.index(joint.child);
    add_collider(*shapes[child], child, i);
    if (link.offset < 0 || joint.held) continue;
    link.rows = std::make_unique<JointRows>(*body_, i, joint);
    world_.addMultiBodyConstraint(link.rows.get());
  }
  world_.addMultiBody(body_.get());
}

Articulation::~Articulation() {
  world_.removeMultiBody(body_.get());
  for (const Link& link : links_) {
    if (link.rows) world_.removeMultiBodyConstraint(link.rows.get());
  }
  for (const auto& collider : colliders_) world_.removeCollisionObject(collider.get());
}

// Parents come before their children, as Bullet wants them.
void Articulation::find_links(std::size_t parent, int parent_link, std::optional<std::size_t> only) {
  const std::vector<Joint>& joints = scene_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].parent != scene_.bodies()[parent].name || (only && *only != i)) continue;
    const Joint& joint = joints[i];
    const std::size_t child = scene_.index(joint.child);
    const Quaternion from_parent = axes_[parent].conjugate();
    const Quaternion from_child = axes_[child].conjugate();
    links_.push_back({i, parent_link, layout_.joint_offset(i),
                      from_child * joint.in_child.orientation * joint.in_parent.orientation.conjugate() * axes_[parent],
                      from_child * (joint.in_child.orientation * joint.axis), from_parent * joint.in_parent.position});
    find_links(child, static_cast<int>(links_.size()) - 1, std::nullopt);
  }
}

void Articulation::set_up(int index, const std::vector<MassProperties>& masses) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  const Joint& joint = scene_.joints()[link.joint];
  const std::size_t child = scene_.index(joint.child);
  const double kilograms = scene_.bodies()[child].mass;
  const btVector3 inertia = to_bullet(masses[child].inertia);
  const btQuaternion turn = to_bullet(link.turn);
  const btVector3 axis = to_bullet(link.axis);
  const btVector3 pivot = to_bullet(link.pivot);
  const btVector3 from_pivot = to_bullet(Vector3(-(axes_[child].conjugate() * joint.in_child.position)));
  if (joint.type == JointType::fixed || joint.held) {
    body_->setupFixed(index, kilograms, inertia, link.parent, turn, pivot, from_pivot);
  } else if (joint.type == JointType::revolute) {
    body_->setupRevolute(index, kilograms, inertia, link.parent, turn, axis, pivot, from_pivot, true);
  } else {
    body_->setupPrismatic(index, kilograms, inertia, link.parent, turn, axis, pivot, from_pivot, true);
  }
}

void Articulation::add_collider(btCollisionShape& shape, std::size_t body, int link) {
  colliders_.push_back(std::make_unique<btMultiBodyLinkCollider>(body_.get(), link));
  btMultiBodyLinkCollider& collider = *colliders_.back();
  collider.setCollisionShape(&shape);
  collider.setFriction(scene_.bodies()[body].friction);
  collider.setUserIndex(static_cast<int>(body));
  collider.setActivationState(DISABLE_DEACTIVATION);
  world_.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  if (link < 0) {
    body_->setBaseCollider(&collider);
  } else {
    body_->getLink(link).m_collider = &collider;
  }
}

// A held joint is rigid where it is: for Bullet a fixed link, turned or shifted to its place.
void Articulation::hold(int index) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  btMultibodyLink& held = body_->getLink(index);
  if (scene_.joints()[link.joint].type == JointType::revolute) {
    held.m_zeroRotParentToThis = btQuaternion(to_bullet(link.axis), -link.held) * to_bullet(link.turn);
  } else {
    held.m_eVector = to_bullet(Vector3(link.pivot + link.turn.conjugate() * link.axis * link.held));
  }
  held.updateCacheMultiDof();
}

void Articulation::restore(const State& state) {
  if (const int offset = layout_.offset(base_); offset >= 0) {
    const BodyState to = StateLayout::read(state.data() + offset);
    body_->setBaseWorldTransform(
        btTransform(to_bullet(Quaternion(to.orientation * axes_[base_])), to_bullet(to.position)));
    body_->setBaseVel(to_bullet(to.velocity));
    body_->setBaseOmega(to_bullet(to.angular_velocity));
  }
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    if (link.offset < 0) continue;
    if (link.rows) {
      body_->setJointPos(i, state[link.offset]);
      body_->setJointVel(i, state[link.offset + 1]);
      link.rows->set_target(scene_.joints()[link.joint].target);
      link.rows->forget();
    } else {
      link.held = state[link.offset];
      hold(i);
    }
  }
  body_->clearForcesAndTorques();
  body_->clearConstraintForces();
  body_->setPosUpdated(false);
  body_->setCompanionId(-1);
  body_->forwardKinematics(rotations_, origins_);
  body_->updateCollisionObjectWorldTransforms(rotations_, origins_);
}

void Articulation::read(State& state) const {
  if (const int offset = layout_.offset(base_); offset >= 0) {
    const Quaternion orientation = from_bullet(body_->getWorldToBaseRot()).conjugate() * axes_[base_].conjugate();
    StateLayout::write({from_bullet(body_->getBasePos()), orientation.normalized(), from_bullet(body_->getBaseVel()),
                        from_bullet(body_->getBaseOmega())},
                       state.data() + offset);
  }
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    const Link& link = links_[static_cast<std::size_t>(i)];
    if (link.offset < 0) continue;
    state[link.offset] = link.rows ? body_->getJointPos(i) : link.held;
    state[link.offset + 1] = link.rows ? body_->getJointVel(i) : 0.0;
  }
}

void Articulation::apply(const btMultiBodyLinkCollider& body, const btVector3& force, const btVector3& torque) {
  if (body.m_link < 0) {
    body_->addBaseForce(force);
    body_->addBaseTorque(torque);
  } else {
    body_->addLinkForce(body.m_link, force);
    body_->addLinkTorque(body.m_link, torque);
  }
}

btVector3 Articulation::velocity(const btMultiBodyLinkCollider& body, const btVector3& point) const {
  std::vector<btVector3> turning(links_.size() + 1);
  std::vector<btVector3> moving(links_.size() + 1);
  body_->compTreeLinkVelocities(turning.data(), moving.data());  // in each link's own axes
  const auto link = static_cast<std::size_t>(body.m_link + 1);
  const btTransform& pose = body.getWorldTransform();
  return pose.getBasis() * moving[link] + (pose.getBasis() * turning[link]).cross(point - pose.getOrigin());
}

void Articulation::set_target(std::size_t joint, double target) {
  for (const Link& link : links_) {
    if (link.joint == joint && link.rows) link.rows->set_target(target);
  }
}

}  // namespace energymargin

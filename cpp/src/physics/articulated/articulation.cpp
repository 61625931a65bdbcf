#include "physics/articulated/articulation.hpp"

#include "energymargin/kinematics.hpp"

namespace energymargin {
namespace {

// Bullet would cut joint velocities off in silence [rad/s or m/s].
constexpr double no_velocity_limit = 1e9;

}  // namespace

Articulation::Articulation(const Scene& scene, const std::vector<CollisionShape>& shapes, std::size_t base,
                           std::optional<std::size_t> first)
    : scene_(scene), layout_(scene), base_(base) {
  const Body& root = scene.bodies()[base];
  for (const Body& body : scene.bodies()) inertials_.push_back(body.principal_inertial());
  find_links(base, -1, first);
  body_ = std::make_unique<btMultiBody>(static_cast<int>(links_.size()), root.mass, to_bullet(inertials_[base].moments),
                                        root.fixed(), false);
  body_->setLinearDamping(0.0);
  body_->setAngularDamping(0.0);
  body_->setMaxCoordinateVelocity(no_velocity_limit);
  body_->setBaseWorldTransform(bullet_pose(inertials_[base], root.state));
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) set_up(i);
  body_->finalizeMultiDof();
  if (!root.fixed()) add_collider(*shapes[base].shape, base, -1);
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    const Joint& joint = scene.joints()[link.joint];
    const std::size_t child = scene.index(joint.child);
    add_collider(*shapes[child].shape, child, i);
    if (link.rigid || joint.mimic) continue;
    link.rows = std::make_unique<JointRows>(*body_, i, joint);
  }
}

std::vector<btMultiBodyConstraint*> Articulation::constraints() const {
  std::vector<btMultiBodyConstraint*> constraints;
  for (const Link& link : links_) {
    if (link.rows) constraints.push_back(link.rows.get());
  }
  return constraints;
}

// Parents come before their children, as Bullet wants them.
void Articulation::find_links(std::size_t parent, int parent_link, std::optional<std::size_t> only) {
  const std::vector<Joint>& joints = scene_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].parent != scene_.bodies()[parent].name || (only && *only != i)) continue;
    const Joint& joint = joints[i];
    const std::size_t child = scene_.index(joint.child);
    const Quaternion from_parent = inertials_[parent].axes.conjugate();
    const Quaternion from_child = inertials_[child].axes.conjugate();
    links_.push_back(
        {i, parent_link, rigid(joint),
         from_child * joint.in_child.orientation * joint.in_parent.orientation.conjugate() * inertials_[parent].axes,
         from_child * (joint.in_child.orientation * joint.axis),
         from_parent * (joint.in_parent.position - inertials_[parent].center)});
    find_links(child, static_cast<int>(links_.size()) - 1, std::nullopt);
  }
}

bool Articulation::rigid(const Joint& joint) const {
  if (joint.mimic) return rigid(scene_.joints()[scene_.joint_index(joint.mimic->joint)]);
  return joint.type == JointType::fixed || joint.held;
}

void Articulation::set_up(int index) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  const Joint& joint = scene_.joints()[link.joint];
  const std::size_t child = scene_.index(joint.child);
  const double kilograms = scene_.bodies()[child].mass;
  const btVector3 inertia = to_bullet(inertials_[child].moments);
  const btQuaternion turn = to_bullet(link.turn);
  const btVector3 axis = to_bullet(link.axis);
  const btVector3 pivot = to_bullet(link.pivot);
  const btVector3 from_pivot =
      to_bullet(Vector3(-(inertials_[child].axes.conjugate() * (joint.in_child.position - inertials_[child].center))));
  if (link.rigid) {
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
  if (link < 0) {
    body_->setBaseCollider(&collider);
  } else {
    body_->getLink(link).m_collider = &collider;
  }
}

std::optional<JointPlace> Articulation::place_of(std::size_t joint) const {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].joint == joint) return JointPlace{body_.get(), static_cast<int>(i)};
  }
  return std::nullopt;
}

// A held joint is rigid where it is: for Bullet a fixed link, turned or shifted to its place.
void Articulation::hold(int index) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  btMultibodyLink& held = body_->getLink(index);
  const JointType type = scene_.joints()[link.joint].type;
  if (type == JointType::fixed) return;
  if (type == JointType::revolute) {
    held.m_zeroRotParentToThis = btQuaternion(to_bullet(link.axis), -link.held) * to_bullet(link.turn);
  } else {
    held.m_eVector = to_bullet(Vector3(link.pivot + link.turn.conjugate() * link.axis * link.held));
  }
  held.updateCacheMultiDof();
}

void Articulation::restore(const State& state) {
  if (const int offset = layout_.offset(base_); offset >= 0) {
    const BodyState frame = StateLayout::read(state.data() + offset);
    const BodyState center = state_at_point(inertials_[base_].center, frame);
    body_->setBaseWorldTransform(bullet_pose(inertials_[base_], frame));
    body_->setBaseVel(to_bullet(center.velocity));
    body_->setBaseOmega(to_bullet(center.angular_velocity));
  }
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    const JointState at = layout_.joint(state.data(), link.joint);
    if (link.rigid) {
      link.held = at.position;
      hold(i);
      continue;
    }
    body_->setJointPos(i, at.position);
    body_->setJointVel(i, at.velocity);
    if (!link.rows) continue;
    link.rows->set_target(scene_.joints()[link.joint].target);
    link.rows->forget();
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
    const Inertial& inertial = inertials_[base_];
    const Quaternion orientation = from_bullet(body_->getWorldToBaseRot()).conjugate() * inertial.axes.conjugate();
    const BodyState center{from_bullet(body_->getBasePos()), orientation.normalized(), from_bullet(body_->getBaseVel()),
                           from_bullet(body_->getBaseOmega())};
    StateLayout::write(state_at_point(-inertial.center, center), state.data() + offset);
  }
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    const Link& link = links_[static_cast<std::size_t>(i)];
    const int offset = layout_.joint_offset(link.joint);
    if (offset < 0) continue;
    state[offset] = link.rigid ? link.held : body_->getJointPos(i);
    state[offset + 1] = link.rigid ? 0.0 : body_->getJointVel(i);
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

const Articulation::LinkVelocities& Articulation::link_velocities() const {
  scratch_.angular.resize(links_.size() + 1);
  scratch_.linear.resize(links_.size() + 1);
  body_->compTreeLinkVelocities(scratch_.angular.data(), scratch_.linear.data());
  return scratch_;
}

btVector3 Articulation::velocity(const btMultiBodyLinkCollider& body, const btVector3& point) const {
  const LinkVelocities& velocities = link_velocities();
  const auto link = static_cast<std::size_t>(body.m_link + 1);
  const btTransform& pose = body.getWorldTransform();
  return pose.getBasis() * velocities.linear[link] +
         (pose.getBasis() * velocities.angular[link]).cross(point - pose.getOrigin());
}

void Articulation::read(std::vector<Velocity>& velocities) const {
  const LinkVelocities& of_links = link_velocities();
  for (const auto& collider : colliders_) {
    const auto link = static_cast<std::size_t>(collider->m_link + 1);
    const btMatrix3x3& axes = collider->getWorldTransform().getBasis();
    velocities[body_index(*collider)] = {axes * of_links.linear[link], axes * of_links.angular[link]};
  }
}

void Articulation::read(Motion& motion) const { read_velocities(motion.trees[body_.get()]); }

void Articulation::read_velocities(std::vector<double>& velocities) const {
  const btScalar* first = body_->getVelocityVector();
  velocities.assign(first, first + base_velocities + body_->getNumDofs());
}

void Articulation::restore_velocities(const std::vector<double>& velocities) {
  const double* numbers = velocities.data();
  body_->setBaseOmega({numbers[0], numbers[1], numbers[2]});
  body_->setBaseVel({numbers[3], numbers[4], numbers[5]});
  for (int link = 0; link < body_->getNumLinks(); ++link) {
    if (body_->getLink(link).m_dofCount == 1) {
      body_->setJointVel(link, numbers[base_velocities + body_->getLink(link).m_dofOffset]);
    }
  }
  body_->clearForcesAndTorques();
}

void Articulation::set_target(std::size_t joint, double target) {
  for (const Link& link : links_) {
    if (link.joint == joint && link.rows) link.rows->set_target(target);
  }
}

std::optional<double> Articulation::target(std::size_t joint) const {
  for (const Link& link : links_) {
    if (link.joint == joint && link.rows) return link.rows->target();
  }
  return std::nullopt;
}

}  // namespace energymargin

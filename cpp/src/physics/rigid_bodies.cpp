#include "physics/rigid_bodies.hpp"

#include "energymargin/kinematics.hpp"
#include "physics/sweep.hpp"

namespace energymargin {
namespace {

// An axis this close to a principal one is that one: 1 - cosine.
constexpr double principal_slack = 1e-12;

// The only axis about which a body is free to turn.
std::optional<int> only_axis(const Vector3& angular_factor) {
  int axis = 0;
  if (angular_factor.sum() != 1.0 || angular_factor.maxCoeff(&axis) != 1.0) return std::nullopt;
  return axis;
}

}  // namespace

RigidBodies::RigidBodies(const Scene& scene, const std::vector<CollisionShape>& shapes) : layout_(scene) {
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.bodies()[i].fixed() || !scene.jointed(i)) add(scene, i, *shapes[i].shape);
  }
}

void RigidBodies::add(const Scene& scene, std::size_t index, btCollisionShape& shape) {
  const Body& body = scene.bodies()[index];
  const Inertial inertial = body.principal_inertial();
  btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, &shape, to_bullet(inertial.moments));
  info.m_startWorldTransform = bullet_pose(inertial, body.state);
  info.m_friction = body.friction;
  all_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody& rigid = *all_.back();
  rigid.setLinearFactor(to_bullet(body.linear_factor));
  rigid.setAngularFactor(to_bullet(body.angular_factor));
  rigid.setFlags(rigid.getFlags() | BT_DISABLE_WORLD_GRAVITY);  // `accelerate` brings it
  if (body.angular_factor != Vector3::Ones()) {
    // Bullet's gyroscopic term would turn the body about its locked axes.
    rigid.setFlags(rigid.getFlags() & ~BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
  }
  rigid.setUserIndex(static_cast<int>(index));
  if (body.fixed()) return;
  if (body.kinematic) make_kinematic(rigid);
  rigid.setActivationState(DISABLE_DEACTIVATION);
  moving_.push_back(&rigid);
  if (body.role == Role::object) objects_.push_back(&rigid);
  Vector3 acceleration = (scene.gravity() + body.force / body.mass).cwiseProduct(body.linear_factor);
  if (body.kinematic) acceleration.setZero();
  free_.push_back({layout_.offset(index), inertial, to_bullet(acceleration),
                   body.kinematic ? std::nullopt : only_axis(body.angular_factor)});
}

// Bullet takes what has no inverse mass for fixed; this one moves.
void RigidBodies::make_kinematic(btRigidBody& rigid) {
  rigid.setMassProps(0.0, btVector3(0, 0, 0));
  rigid.setCollisionFlags(rigid.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT);
  rigid.setFlags(rigid.getFlags() & ~BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
}

// About its only free axis a body turns by its moment about that axis. Bullet would take the inverse inertia's part,
// which is another number where the axis is none of the principal ones.
void RigidBodies::set_moment(std::size_t free) {
  btRigidBody& rigid = *moving_[free];
  const Vector3 axis = from_bullet(rigid.getWorldTransform().getBasis()[*free_[free].turning_axis]);
  const bool principal = axis.cwiseAbs().maxCoeff() > 1.0 - principal_slack;
  const Vector3& moments = free_[free].inertial.moments;
  const Vector3 acting = principal ? moments : Vector3::Constant(moments.dot(axis.cwiseAbs2()));
  rigid.setInvInertiaDiagLocal(to_bullet(Vector3(acting.cwiseInverse())));
  rigid.updateInertiaTensor();
}

void RigidBodies::restore(const State& state) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Inertial& inertial = free_[i].inertial;
    btRigidBody& rigid = *moving_[i];
    const BodyState frame = StateLayout::read(state.data() + free_[i].offset);
    const BodyState center = state_at_point(inertial.center, frame);
    const btTransform transform = bullet_pose(inertial, frame);
    rigid.setCenterOfMassTransform(transform);
    rigid.setInterpolationWorldTransform(transform);
    rigid.setLinearVelocity(to_bullet(center.velocity));
    rigid.setInterpolationLinearVelocity(rigid.getLinearVelocity());
    rigid.setAngularVelocity(to_bullet(center.angular_velocity));
    rigid.setInterpolationAngularVelocity(rigid.getAngularVelocity());
    if (free_[i].turning_axis) set_moment(i);
    rigid.clearForces();
  }
}

void RigidBodies::read(State& state) const {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Inertial& inertial = free_[i].inertial;
    const btRigidBody& rigid = *moving_[i];
    const btTransform& transform = rigid.getCenterOfMassTransform();
    const Quaternion orientation = from_bullet(transform.getRotation()) * inertial.axes.conjugate();
    const BodyState center{from_bullet(transform.getOrigin()), orientation.normalized(),
                           from_bullet(rigid.getLinearVelocity()), from_bullet(rigid.getAngularVelocity())};
    StateLayout::write(state_at_point(-inertial.center, center), state.data() + free_[i].offset);
  }
}

void RigidBodies::read(std::vector<Velocity>& velocities) const {
  for (const btRigidBody* body : moving_) {
    velocities[body_index(*body)] = {body->getLinearVelocity(), body->getAngularVelocity()};
  }
}

void RigidBodies::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const btRigidBody& rigid = *moving_[i];
    motion.bodies[body_index(rigid)] = {rigid.getLinearVelocity(), rigid.getAngularVelocity(),
                                        is_kinematic(rigid) ? none : free_[i].acceleration / rigid.getInvMass(), none};
  }
}

void RigidBodies::accelerate(double duration) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    moving_[i]->setLinearVelocity(moving_[i]->getLinearVelocity() + free_[i].acceleration * duration);
  }
}

void RigidBodies::save() {
  snapshots_.resize(moving_.size());
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    snapshots_[i] = {moving_[i]->getWorldTransform(),
                     {moving_[i]->getLinearVelocity(), moving_[i]->getAngularVelocity()}};
  }
}

void RigidBodies::undo() {
  undo_split_impulses();
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    moving_[i]->setLinearVelocity(snapshots_[i].velocity.linear);
    moving_[i]->setAngularVelocity(snapshots_[i].velocity.angular);
  }
}

void RigidBodies::undo_split_impulses() {
  for (std::size_t i = 0; i < moving_.size(); ++i) moving_[i]->setWorldTransform(snapshots_[i].pose);
}

// A kinematic body loses no time.
void RigidBodies::move(double duration, double share) {
  for (btRigidBody* body : moving_) {
    btTransform pose;
    if (share == 1.0 || is_kinematic(*body)) {
      body->predictIntegratedTransform(duration, pose);
    } else {
      pose = integrated_pose(body->getWorldTransform(), body->getLinearVelocity() * duration,
                             integrated_turn(body->getAngularVelocity() * duration), share);
    }
    body->proceedToTransform(pose);
  }
}

void apply_load(btRigidBody& body, const Load& load, double duration) {
  body.applyCentralImpulse(load.force * duration);
  body.applyTorqueImpulse(load.torque * duration);
}

void set_velocities(btRigidBody& body, const Motor& motor) {
  body.setLinearVelocity(motor.linear * body.getLinearFactor());
  body.setAngularVelocity(motor.angular * body.getAngularFactor());
}

btVector3 velocity_at(const btRigidBody& body, const btVector3& point) {
  return body.getVelocityInLocalPoint(point - body.getCenterOfMassPosition());
}

}  // namespace energymargin

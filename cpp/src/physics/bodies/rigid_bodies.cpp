#include "physics/bodies/rigid_bodies.hpp"

#include "energymargin/kinematics.hpp"
#include "physics/sweep.hpp"

namespace energymargin {
RigidBodies::RigidBodies(const Scene& scene) : layout_(scene), slots_(scene.bodies().size(), -1) {
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.bodies()[i].fixed() || !scene.jointed(i)) add(scene, i);
  }
}

void RigidBodies::add(const Scene& scene, std::size_t index) {
  const Body& body = scene.bodies()[index];
  const Inertial& inertial = scene.inertial(index);
  btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, scene.collision_shape(index).shape.get(),
                                                to_bullet(inertial.moments));
  info.m_startWorldTransform = bullet_pose(inertial, body.state);
  info.m_friction = body.friction;
  all_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody& rigid = *all_.back();
  rigid.setLinearFactor(to_bullet(body.linear_factor));
  rigid.setAngularFactor(to_bullet(body.angular_factor));
  rigid.setFlags(rigid.getFlags() | BT_DISABLE_WORLD_GRAVITY);  // `accelerate` brings it
  rigid.setUserIndex(static_cast<int>(index));
  if (body.fixed()) return;
  if (body.kinematic) {  // Bullet takes what has no inverse mass for fixed; this one moves
    rigid.setMassProps(0.0, btVector3(0, 0, 0));
    rigid.setCollisionFlags(rigid.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT);
  }
  rigid.setActivationState(DISABLE_DEACTIVATION);
  slots_[index] = static_cast<int>(moving_.size());
  moving_.push_back(&rigid);
  loads_.push_back({index, btVector3(0, 0, 0), btVector3(0, 0, 0)});
  ways_.push_back({});
  if (body.role == Role::object) objects_.push_back(&rigid);
  Vector3 acceleration = (scene.gravity() + body.force / body.mass).cwiseProduct(body.linear_factor);
  if (body.kinematic) acceleration.setZero();
  free_.push_back({layout_.offset(index), inertial, to_bullet(inertial.moments), to_bullet(acceleration)});
}

void RigidBodies::restore(const State& state) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Inertial& inertial = free_[i].inertial;
    btRigidBody& rigid = *moving_[i];
    const BodyState frame = StateLayout::read(state.data() + free_[i].offset);
    const BodyState center = state_at_point(inertial.center, frame);
    rigid.setCenterOfMassTransform(bullet_pose(inertial, frame));
    rigid.setLinearVelocity(to_bullet(center.velocity));
    rigid.setAngularVelocity(to_bullet(center.angular_velocity));
  }
}

void RigidBodies::read(State& state) const {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const btRigidBody& rigid = *moving_[i];
    const BodyState frame =
        frame_state(free_[i].inertial, rigid.getCenterOfMassTransform(), from_bullet(rigid.getLinearVelocity()),
                    from_bullet(rigid.getAngularVelocity()));
    StateLayout::write(frame, state.data() + free_[i].offset);
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

void RigidBodies::apply(const Load& load) {
  const auto i = static_cast<std::size_t>(slots_[load.body]);
  loads_[i].force += load.force;
  loads_[i].torque += load.torque;
}

void RigidBodies::clear_loads() {
  for (Load& load : loads_) load.force = load.torque = btVector3(0, 0, 0);
}

btVector3 RigidBodies::acceleration(std::size_t i) const {
  return free_[i].acceleration + loads_[i].force * moving_[i]->getInvMass() * moving_[i]->getLinearFactor();
}

void RigidBodies::read_ways(std::vector<Velocity>& velocities) const {
  for (std::size_t i = 0; i < moving_.size(); ++i) velocities[body_index(*moving_[i])] = ways_[i];
}

void RigidBodies::move(double duration, double share) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    btRigidBody& body = *moving_[i];
    const double moved = is_kinematic(body) ? duration : share * duration;
    body.setCenterOfMassTransform(
        moved_pose(body.getWorldTransform(), ways_[i].linear * moved, ways_[i].angular * moved));
  }
}

btMatrix3x3 RigidBodies::inertia(std::size_t i) const {
  const btMatrix3x3& axes = moving_[i]->getWorldTransform().getBasis();
  return axes.scaled(free_[i].moments).timesTranspose(axes);
}

}  // namespace energymargin

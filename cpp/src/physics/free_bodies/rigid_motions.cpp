#include "physics/free_bodies/rigid_motions.hpp"

#include <LinearMath/btTransformUtil.h>

#include <cmath>

namespace energymargin {
namespace {

// Beyond it Bullet goes on along the tangent of the quaternion, and normalizes that.
constexpr double most_turn = ANGULAR_MOTION_THRESHOLD;  // rad

}  // namespace

void RigidMotions::keep(const std::vector<btRigidBody*>& bodies) {
  motions_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    motions_[i] = {bodies[i]->getWorldTransform(), {bodies[i]->getLinearVelocity(), bodies[i]->getAngularVelocity()}};
  }
}

void RigidMotions::undo(const std::vector<btRigidBody*>& bodies) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i]->setWorldTransform(motions_[i].pose);
    bodies[i]->setLinearVelocity(motions_[i].velocity.linear);
    bodies[i]->setAngularVelocity(motions_[i].velocity.angular);
  }
}

void RigidMotions::undo_split_impulses(const std::vector<btRigidBody*>& bodies) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i]->setWorldTransform(motions_[i].pose);
}

void read_velocities(const std::vector<btRigidBody*>& bodies, std::vector<Velocity>& velocities) {
  for (const btRigidBody* body : bodies) {
    velocities[static_cast<std::size_t>(body->getUserIndex())] = {body->getLinearVelocity(),
                                                                  body->getAngularVelocity()};
  }
}

btVector3 made_turn(const btVector3& turn) {
  const double angle = turn.length();
  if (!(angle > most_turn)) return turn;
  return turn * (2.0 * std::atan(angle / most_turn * std::tan(0.5 * most_turn)) / angle);
}

btTransform moved(const btTransform& start, const btVector3& way, const btVector3& turn, double share) {
  btTransform pose;
  const double angle = turn.length() * share;
  if (angle > most_turn) {
    pose.setRotation((btQuaternion(turn.normalized(), angle) * start.getRotation()).normalized());
    pose.setOrigin(start.getOrigin() + way * share);
  } else {
    btTransformUtil::integrateTransform(start, way, turn, share, pose);
  }
  return pose;
}

void move(const std::vector<btRigidBody*>& bodies, double duration, double share) {
  for (btRigidBody* body : bodies) {
    btTransform pose;
    if (share == 1.0) {
      body->predictIntegratedTransform(duration, pose);
    } else {
      pose = moved(body->getWorldTransform(), body->getLinearVelocity() * duration,
                   made_turn(body->getAngularVelocity() * duration), share);
    }
    body->proceedToTransform(pose);
  }
}

}  // namespace energymargin

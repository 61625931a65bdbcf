#include "rigid_motions.hpp"

namespace energymargin {

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

void read_velocities(const std::vector<btRigidBody*>& bodies, std::vector<Velocity>& velocities) {
  for (const btRigidBody* body : bodies) {
    velocities[static_cast<std::size_t>(body->getUserIndex())] = {body->getLinearVelocity(),
                                                                  body->getAngularVelocity()};
  }
}

void move(const std::vector<btRigidBody*>& bodies, double duration) {
  for (btRigidBody* body : bodies) {
    btTransform moved;
    body->predictIntegratedTransform(duration, moved);
    body->proceedToTransform(moved);
  }
}

}  // namespace energymargin

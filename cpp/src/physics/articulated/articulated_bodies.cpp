#include "physics/articulated/articulated_bodies.hpp"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>

#include "physics/articulated/solver_row.hpp"

namespace energymargin {

ArticulatedBodies::ArticulatedBodies(btCollisionDispatcher& dispatcher, WatchedSolver& solver,
                                     btMultiBodyDynamicsWorld& world)
    : Stepper(dispatcher), solver_(solver), world_(world) {
  for (int i = 0; i < world.getNumMultibodies(); ++i) trees_.push_back(world.getMultiBody(i));
  for (int i = 0; i < world.getNumMultiBodyConstraints(); ++i) constraints_.push_back(world.getMultiBodyConstraint(i));
  of_joints_ = constraints_.size();
  kept_velocities_.resize(trees_.size());
}

void ArticulatedBodies::add(btRigidBody& moving) {
  rigids_.push_back(&moving);
  moving_.push_back(&moving);
}

void ArticulatedBodies::add(btMultiBodyLinkCollider& collider) {
  colliders_.push_back(&collider);
  moving_.push_back(&collider);
}

void ArticulatedBodies::keep() {
  kept_.keep(rigids_);
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    const btScalar* first = trees_[i]->getVelocityVector();
    kept_velocities_[i].assign(first, first + base_velocities + trees_[i]->getNumDofs());
  }
}

void ArticulatedBodies::undo() {
  kept_.undo(rigids_);
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    btMultiBody& tree = *trees_[i];
    const double* kept = kept_velocities_[i].data();
    tree.setBaseOmega({kept[0], kept[1], kept[2]});
    tree.setBaseVel({kept[3], kept[4], kept[5]});
    for (int link = 0; link < tree.getNumLinks(); ++link) {
      if (tree.getLink(link).m_dofCount == 1) {
        tree.setJointVel(link, kept[base_velocities + tree.getLink(link).m_dofOffset]);
      }
    }
    tree.clearForcesAndTorques();
  }
}

void ArticulatedBodies::solve(double duration, btContactSolverInfo& info) {
  const btVector3 gravity = world_.getGravity();
  for (btMultiBody* tree : trees_) {
    tree->forwardKinematics(rotations_, origins_);
    tree->clearConstraintForces();
    tree->addBaseForce(gravity * tree->getBaseMass());
    for (int i = 0; i < tree->getNumLinks(); ++i) tree->addLinkForce(i, gravity * tree->getLinkMass(i));
    tree->computeAccelerationsArticulatedBodyAlgorithmMultiDof(duration, numbers_, vectors_, matrices_, false,
                                                               info.m_jointFeedbackInWorldSpace,
                                                               info.m_jointFeedbackInJointFrame);
  }
  info.m_timeStep = duration;
  set_up_motors();
  std::vector<btPersistentManifold*> touching = pairs().touching();
  solver_.solveMultiBodyGroup(moving_.data(), static_cast<int>(moving_.size()), touching.data(),
                              static_cast<int>(touching.size()), of_rigids_.data(), static_cast<int>(of_rigids_.size()),
                              constraints_.data(), static_cast<int>(constraints_.size()), info, nullptr, nullptr);
  for (btMultiBody* tree : trees_) tree->processDeltaVeeMultiDof2();
}

void ArticulatedBodies::set_up_motors() {
  constraints_.resize(of_joints_);
  base_motors_.clear();
  rigid_motors_.clear();
  of_rigids_.clear();
  for (const Motor& motor : motors()) {
    const auto is_its = [&motor](const btCollisionObject* object) {
      return object->getUserIndex() == static_cast<int>(motor.body);
    };
    const auto rigid = std::find_if(rigids_.begin(), rigids_.end(), is_its);
    if (rigid != rigids_.end()) {
      rigid_motors_.push_back(std::make_unique<RigidMotor>(**rigid, motor));
      of_rigids_.push_back(rigid_motors_.back().get());
    } else {
      const auto base = std::find_if(colliders_.begin(), colliders_.end(), is_its);
      base_motors_.push_back(std::make_unique<BaseMotor>(*(*base)->m_multiBody, motor));
      constraints_.push_back(base_motors_.back().get());
    }
  }
}

void ArticulatedBodies::read(std::vector<Velocity>& velocities) const {
  read_velocities(rigids_, velocities);
  const btMultiBody* of = nullptr;
  for (const btMultiBodyLinkCollider* collider : colliders_) {
    if (collider->m_multiBody != of) {
      of = collider->m_multiBody;
      turning_.resize(static_cast<std::size_t>(of->getNumLinks()) + 1);
      moving_links_.resize(turning_.size());
      of->compTreeLinkVelocities(turning_.data(), moving_links_.data());  // in each link's own axes
    }
    const auto link = static_cast<std::size_t>(collider->m_link + 1);
    const btMatrix3x3& axes = collider->getWorldTransform().getBasis();
    velocities[static_cast<std::size_t>(collider->getUserIndex())] = {axes * moving_links_[link],
                                                                      axes * turning_[link]};
  }
}

void ArticulatedBodies::move(double duration, double share) {
  energymargin::move(rigids_, duration, share);
  for (btMultiBody* tree : trees_) {
    tree->stepPositionsMultiDof(share * duration);
    tree->updateCollisionObjectWorldTransforms(rotations_, origins_);
    tree->clearForcesAndTorques();
  }
}

}  // namespace energymargin

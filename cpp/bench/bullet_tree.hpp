#pragma once
// A tree of links as one of Bullet's own multi-bodies, for comparison.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! A joint's drive and stops as rows of Bullet's solver, with the library's laws: an implicit spring and damper within
//! its torque limit, and stops that the joint may not cross in a step.
class BulletJoint : public btMultiBodyConstraint {
 public:
  BulletJoint(btMultiBody& body, int link, const Joint& joint)
      : btMultiBodyConstraint(&body, nullptr, link, -1, 3, false, MULTIBODY_CONSTRAINT_1DOF_JOINT_MOTOR),
        joint_(joint) {
    allocateJacobiansMultiDof();
    forget();
  }

  //! The solver goes on from the last step's impulses.
  void forget() {
    for (int row = 0; row < 3; ++row) internalSetAppliedImpulse(row, 0.0);
  }

  void finalizeMultiDof() override {}
  int getIslandIdA() const override { return m_bodyA->getLink(m_linkA).m_collider->getIslandTag(); }
  int getIslandIdB() const override { return -1; }
  void debugDraw(btIDebugDraw*) override {}
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  btMultiBodySolverConstraint& add_row(int number, double direction, btMultiBodyConstraintArray& rows,
                                       btMultiBodyJacobianData& data);

  const Joint& joint_;
};

//! The links on one fixed body that hang on joint `first`. Throws std::invalid_argument on what no task has: joints
//! that follow others, and loaded links.
class BulletTree {
 public:
  BulletTree(const Scene& scene, std::size_t base, std::size_t first);

  btMultiBody& multi_body() { return *body_; }
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const { return colliders_; }
  const std::vector<std::unique_ptr<BulletJoint>>& joints() const { return rows_; }

  void restore(const State& state);
  void read(State& state) const;

 private:
  struct Link {
    std::size_t joint;  // in the scene
    int parent;         // among the links; -1: the base
    Quaternion turn;    // from vectors in the parent's principal axes to those in the link's, at position 0
    Vector3 axis;       // in the link's principal axes
    Vector3 pivot;      // in the parent's principal axes
  };

  void find_links(std::size_t parent, int parent_link, std::size_t only);
  void set_up(int link);
  void hold(int link, double position);
  bool rigid(const Link& link) const;

  const Scene& scene_;
  StateLayout layout_;
  std::vector<Inertial> inertials_;  // of each body of the scene
  std::vector<Link> links_;
  std::vector<double> held_;  // positions of the links that are rigid
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<std::unique_ptr<BulletJoint>> rows_;
};

//! One for each joint on a fixed body.
inline std::vector<std::unique_ptr<BulletTree>> bullet_trees(const Scene& scene) {
  std::vector<std::unique_ptr<BulletTree>> trees;
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    const std::size_t parent = scene.index(scene.joints()[i].parent);
    if (scene.joint_to(parent)) continue;
    if (!scene.bodies()[parent].fixed()) throw std::invalid_argument("no comparison for links on a free body");
    trees.push_back(std::make_unique<BulletTree>(scene, parent, i));
  }
  return trees;
}

inline void BulletJoint::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                              const btContactSolverInfo& info) {
  const double duration = info.m_timeStep;
  const double position = m_bodyA->getJointPos(m_linkA);
  const double velocity = m_bodyA->getJointVel(m_linkA);
  if (const double gain = duration * joint_.stiffness + joint_.damping; gain > 0.0) {
    btMultiBodySolverConstraint& row = add_row(0, 1.0, rows, data);
    const double softness = 1.0 / (duration * gain);
    const double target =
        (joint_.stiffness * (joint_.target - position) + joint_.damping * joint_.target_velocity) / gain;
    row.m_jacDiagABInv = 1.0 / (1.0 / row.m_jacDiagABInv + softness);
    row.m_cfm = softness * row.m_jacDiagABInv;
    row.m_rhs = (target - velocity) * row.m_jacDiagABInv;
    row.m_upperLimit = std::min(joint_.torque_limit * duration, 1e10);
    row.m_lowerLimit = -row.m_upperLimit;
  }
  const btScalar* velocities = m_bodyA->getVelocityVector() + 6;
  double fastest = 0.0;
  for (int i = 0; i < m_bodyA->getNumDofs(); ++i) fastest = std::max(fastest, std::abs(velocities[i]));
  const double reach = std::max(0.05, 4.0 * duration * fastest);
  for (const double direction : {1.0, -1.0}) {
    const double gap = direction > 0.0 ? position - joint_.lower : joint_.upper - position;
    if (!(gap < reach)) continue;
    btMultiBodySolverConstraint& row = add_row(direction > 0.0 ? 1 : 2, direction, rows, data);
    row.m_rhs = (-std::max(gap, 0.0) / duration - direction * velocity) * row.m_jacDiagABInv;
    row.m_lowerLimit = 0.0;
    row.m_upperLimit = 1e10;
  }
}

inline btMultiBodySolverConstraint& BulletJoint::add_row(int number, double direction, btMultiBodyConstraintArray& rows,
                                                         btMultiBodyJacobianData& data) {
  const int velocities = 6 + m_bodyA->getNumDofs();
  if (m_bodyA->getCompanionId() < 0) {
    m_bodyA->setCompanionId(data.m_deltaVelocities.size());
    data.m_deltaVelocities.resize(data.m_deltaVelocities.size() + velocities, 0.0);
  }
  btMultiBodySolverConstraint& row = rows.expandNonInitializing();
  row = btMultiBodySolverConstraint();
  for (btVector3* arm :
       {&row.m_relpos1CrossNormal, &row.m_contactNormal1, &row.m_relpos2CrossNormal, &row.m_contactNormal2}) {
    arm->setZero();
  }
  row.m_appliedImpulse = row.m_cfm = 0.0;
  row.m_solverBodyIdA = row.m_solverBodyIdB = -1;
  row.m_orgConstraint = this;
  row.m_orgDofIndex = number;
  row.m_multiBodyA = m_bodyA;
  row.m_multiBodyB = nullptr;
  row.m_linkA = m_linkA;
  row.m_deltaVelAindex = m_bodyA->getCompanionId();
  row.m_jacAindex = data.m_jacobians.size();
  data.m_jacobians.resize(row.m_jacAindex + velocities, 0.0);
  data.m_deltaVelocitiesUnitImpulse.resize(row.m_jacAindex + velocities, 0.0);
  const int at = row.m_jacAindex + 6 + m_bodyA->getLink(m_linkA).m_dofOffset;
  data.m_jacobians[at] = direction;
  m_bodyA->calcAccelerationDeltasMultiDof(&data.m_jacobians[row.m_jacAindex],
                                          &data.m_deltaVelocitiesUnitImpulse[row.m_jacAindex], data.scratch_r,
                                          data.scratch_v);
  row.m_jacDiagABInv = 1.0 / (direction * data.m_deltaVelocitiesUnitImpulse[at]);
  return row;
}

inline BulletTree::BulletTree(const Scene& scene, std::size_t base, std::size_t first) : scene_(scene), layout_(scene) {
  for (const Body& body : scene.bodies()) inertials_.push_back(body.principal_inertial());
  find_links(base, -1, first);
  body_ = std::make_unique<btMultiBody>(static_cast<int>(links_.size()), 0.0, btVector3(0, 0, 0), true, false);
  body_->setLinearDamping(0.0);
  body_->setAngularDamping(0.0);
  body_->setMaxCoordinateVelocity(1e9);  // it would cut them off in silence
  body_->setBaseWorldTransform(bullet_pose(inertials_[base], scene.bodies()[base].state));
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    set_up(i);
  }
  body_->finalizeMultiDof();
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    const Link& link = links_[static_cast<std::size_t>(i)];
    if (!rigid(link)) rows_.push_back(std::make_unique<BulletJoint>(*body_, i, scene.joints()[link.joint]));
  }
}

inline bool BulletTree::rigid(const Link& link) const { return scene_.rigid(scene_.joints()[link.joint]); }

// Parents come before their children, as Bullet wants them.
inline void BulletTree::find_links(std::size_t parent, int parent_link, std::size_t only) {
  const std::vector<Joint>& joints = scene_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Joint& joint = joints[i];
    if (joint.parent != scene_.bodies()[parent].name || (parent_link < 0 && i != only)) continue;
    if (joint.mimic) throw std::invalid_argument("no comparison for a joint that follows another: " + joint.name);
    const std::size_t child = scene_.index(joint.child);
    if (!scene_.bodies()[child].force.isZero(0.0)) {
      throw std::invalid_argument("no comparison for a constant force on a link: " + joint.child);
    }
    const Quaternion from_parent = inertials_[parent].axes.conjugate();
    const Quaternion from_child = inertials_[child].axes.conjugate();
    links_.push_back(
        {i, parent_link,
         from_child * joint.in_child.orientation * joint.in_parent.orientation.conjugate() * inertials_[parent].axes,
         from_child * (joint.in_child.orientation * joint.axis),
         from_parent * (joint.in_parent.position - inertials_[parent].center)});
    find_links(child, static_cast<int>(links_.size()) - 1, only);
  }
}

inline void BulletTree::set_up(int index) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  const Joint& joint = scene_.joints()[link.joint];
  const std::size_t child = scene_.index(joint.child);
  const Body& body = scene_.bodies()[child];
  const Inertial& inertial = inertials_[child];
  const btVector3 inertia = to_bullet(inertial.moments);
  const btQuaternion turn = to_bullet(link.turn);
  const btVector3 axis = to_bullet(link.axis);
  const btVector3 pivot = to_bullet(link.pivot);
  const btVector3 arm = to_bullet(Vector3(inertial.axes.conjugate() * (inertial.center - joint.in_child.position)));
  if (rigid(link)) {
    body_->setupFixed(index, body.mass, inertia, link.parent, turn, pivot, arm);
  } else if (joint.type == JointType::revolute) {
    body_->setupRevolute(index, body.mass, inertia, link.parent, turn, axis, pivot, arm, true);
  } else {
    body_->setupPrismatic(index, body.mass, inertia, link.parent, turn, axis, pivot, arm, true);
  }
  colliders_.push_back(std::make_unique<btMultiBodyLinkCollider>(body_.get(), index));
  btMultiBodyLinkCollider& collider = *colliders_.back();
  collider.setCollisionShape(scene_.collision_shape(child).shape.get());
  collider.setFriction(body.friction);
  collider.setUserIndex(static_cast<int>(child));
  collider.setActivationState(DISABLE_DEACTIVATION);
  body_->getLink(index).m_collider = &collider;
}

// A held joint is rigid where it is: for Bullet a fixed link, turned or shifted to its place.
inline void BulletTree::hold(int index, double position) {
  const Link& link = links_[static_cast<std::size_t>(index)];
  btMultibodyLink& held = body_->getLink(index);
  const JointType type = scene_.joints()[link.joint].type;
  if (type == JointType::revolute) {
    held.m_zeroRotParentToThis = btQuaternion(to_bullet(link.axis), -position) * to_bullet(link.turn);
  } else if (type == JointType::prismatic) {
    held.m_eVector = to_bullet(Vector3(link.pivot + link.turn.conjugate() * link.axis * position));
  }
  held.updateCacheMultiDof();
}

inline void BulletTree::restore(const State& state) {
  held_.assign(links_.size(), 0.0);
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    const Link& link = links_[static_cast<std::size_t>(i)];
    const JointState at = layout_.joint(state.data(), link.joint);
    if (rigid(link)) {
      held_[static_cast<std::size_t>(i)] = at.position;
      hold(i, at.position);
    } else {
      body_->setJointPos(i, at.position);
      body_->setJointVel(i, at.velocity);
    }
  }
  for (const auto& row : rows_) row->forget();
  body_->clearForcesAndTorques();
  body_->clearConstraintForces();
  body_->setPosUpdated(false);
  body_->setCompanionId(-1);
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> origins;
  body_->forwardKinematics(rotations, origins);
  body_->updateCollisionObjectWorldTransforms(rotations, origins);
}

inline void BulletTree::read(State& state) const {
  for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
    const Link& link = links_[static_cast<std::size_t>(i)];
    const int offset = layout_.joint_offset(link.joint);
    if (offset < 0) continue;
    state[offset] = rigid(link) ? held_[static_cast<std::size_t>(i)] : body_->getJointPos(i);
    state[offset + 1] = rigid(link) ? 0.0 : body_->getJointVel(i);
  }
}

}  // namespace energymargin

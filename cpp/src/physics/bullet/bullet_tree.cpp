#include "physics/bullet/bullet_tree.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

constexpr double unlimited = 1e10;  // N s: Bullet's own

// Nothing moves a kinematic base: so many times as heavy as all that hangs on it, or as 1 kg.
constexpr double unmoved = 1e8;

// A joint is not pushed back from so little beyond its stop [rad or m].
constexpr double stop_slop = 1e-3;

btQuaternion turn_of(const btMatrix3x3& basis) {
  btQuaternion turn;
  basis.getRotation(turn);
  return turn;
}

}  // namespace

Velocity damping_of(const Body& body, const Velocity& velocity, double mass, const btVector3& moments,
                    const btMatrix3x3& axes, double duration) {
  const auto share = [duration](double damping, double inertia) {
    return damping > 0.0 ? damping * inertia / (inertia + duration * damping) : 0.0;
  };
  btVector3 spin = velocity.angular * axes;
  for (int axis = 0; axis < 3; ++axis) spin[axis] *= share(body.angular_damping, moments[axis]);
  return {-velocity.linear * share(body.linear_damping, mass), -(axes * spin)};
}

BulletRows::BulletRows(btMultiBody& body, int link, btMultiBody* other, int other_link, int rows)
    : btMultiBodyConstraint(&body, other, link, other_link, rows, false, MULTIBODY_CONSTRAINT_1DOF_JOINT_MOTOR) {
  allocateJacobiansMultiDof();
  forget();
}

void BulletRows::forget() {
  for (int row = 0; row < getNumRows(); ++row) internalSetAppliedImpulse(row, 0.0);
}

BulletRows::Side BulletRows::add_side(btMultiBody& body, const std::vector<BulletTerm>& terms,
                                      btMultiBodyJacobianData& data) {
  const int velocities = 6 + body.getNumDofs();
  if (body.getCompanionId() < 0) {
    body.setCompanionId(data.m_deltaVelocities.size());
    data.m_deltaVelocities.resize(data.m_deltaVelocities.size() + velocities, 0.0);
  }
  Side side{body.getCompanionId(), data.m_jacobians.size(), 0.0, 0.0};
  data.m_jacobians.resize(side.jacobian + velocities, 0.0);
  data.m_deltaVelocitiesUnitImpulse.resize(side.jacobian + velocities, 0.0);
  for (const BulletTerm& of : terms) {
    if (of.body == &body) data.m_jacobians[side.jacobian + of.velocity] = of.coefficient;
  }
  body.calcAccelerationDeltasMultiDof(&data.m_jacobians[side.jacobian],
                                      &data.m_deltaVelocitiesUnitImpulse[side.jacobian], data.scratch_r,
                                      data.scratch_v);
  for (const BulletTerm& of : terms) {
    if (of.body != &body) continue;
    side.inverse_mass += of.coefficient * data.m_deltaVelocitiesUnitImpulse[side.jacobian + of.velocity];
    side.velocity += of.coefficient * body.getVelocityVector()[of.velocity];
  }
  return side;
}

btMultiBodySolverConstraint& BulletRows::add_row(int number, const std::vector<BulletTerm>& terms, double target,
                                                 btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data) {
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
  row.m_multiBodyB = m_bodyB;
  row.m_linkA = m_linkA;
  row.m_linkB = m_linkB;
  Side both = add_side(*m_bodyA, terms, data);
  row.m_deltaVelAindex = both.velocities;
  row.m_jacAindex = both.jacobian;
  if (m_bodyB) {
    const Side other = add_side(*m_bodyB, terms, data);
    row.m_deltaVelBindex = other.velocities;
    row.m_jacBindex = other.jacobian;
    both.inverse_mass += other.inverse_mass;
    both.velocity += other.velocity;
  }
  row.m_jacDiagABInv = 1.0 / both.inverse_mass;
  row.m_rhs = (target - both.velocity) * row.m_jacDiagABInv;
  row.m_lowerLimit = -unlimited;
  row.m_upperLimit = unlimited;
  return row;
}

void BulletRows::limit(btMultiBodySolverConstraint& row, double impulse) {
  row.m_upperLimit = std::min(impulse, unlimited);
  row.m_lowerLimit = -row.m_upperLimit;
}

void BulletJoint::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                       const btContactSolverInfo& info) {
  const double duration = info.m_timeStep, position = m_bodyA->getJointPos(m_linkA);
  const auto along = [&](double direction) { return BulletTerm::of_joint(*m_bodyA, m_linkA, direction); };
  const double gain = control_ ? duration * joint_.stiffness + joint_.damping : 0.0;
  if (gain > 0.0) {
    const double target =
        (joint_.stiffness * (control_->target - position) + joint_.damping * joint_.target_velocity) / gain;
    btMultiBodySolverConstraint& row = add_row(0, {along(1.0)}, target, rows, data);
    const double softness = 1.0 / (duration * gain), rigid = row.m_jacDiagABInv;
    row.m_jacDiagABInv = 1.0 / (1.0 / rigid + softness);
    row.m_cfm = softness * row.m_jacDiagABInv;
    row.m_rhs *= row.m_jacDiagABInv / rigid;
    limit(row, joint_.torque_limit * duration);
  }
  if (joint_.friction > 0.0) limit(add_row(3, {along(1.0)}, 0.0, rows, data), joint_.friction * duration);
  const btScalar* velocities = m_bodyA->getVelocityVector() + 6;
  double fastest = 0.0;
  for (int i = 0; i < m_bodyA->getNumDofs(); ++i) fastest = std::max(fastest, std::abs(velocities[i]));
  const double reach = stop_reach(duration, fastest);
  for (const double direction : {1.0, -1.0}) {
    const double gap = direction > 0.0 ? position - joint_.lower : joint_.upper - position;
    if (!(gap < reach)) continue;
    const double beyond = std::max(-gap - stop_slop, 0.0);
    const double target = (info.m_erp * beyond - std::max(gap, 0.0)) / duration;
    add_row(direction > 0.0 ? 1 : 2, {along(direction)}, target, rows, data).m_lowerLimit = 0.0;
  }
}

void BulletMimic::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                       const btContactSolverInfo& info) {
  double off = -constant_;
  std::vector<BulletTerm> terms;
  for (const Side& of : sides_) {
    off += of.coefficient * of.body.getJointPos(of.link);
    terms.push_back(BulletTerm::of_joint(of.body, of.link, of.coefficient));
  }
  add_row(0, terms, -off * info.m_erp / info.m_timeStep, rows, data);
}

void BulletBaseMotor::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                           const btContactSolverInfo& info) {
  for (int axis = 0; axis < velocities_of_free_body; ++axis) {
    const int velocity = (axis + 3) % velocities_of_free_body;
    limit(add_row(axis, {{m_bodyA, velocity, 1.0}}, motor_.velocity[axis], rows, data),
          (axis < 3 ? motor_.force : motor_.torque) * info.m_timeStep);
  }
}

BulletTree::BulletTree(const Scene& scene, Articulation& tree) : scene_(scene), layout_(scene), tree_(tree) {
  const Articulation::Link& base = tree.link(0);
  const int links = static_cast<int>(tree.links().size()) - 1;
  double mass = base.mass;
  btVector3 moments = base.moments;
  if (tree.kinematic()) {
    for (int index = 1; index <= links; ++index) heaviness_ += tree.link(index).mass;
    mass = heaviness_ = unmoved * std::max(heaviness_, 1.0);
    moments = btVector3(mass, mass, mass);
  }
  body_ = std::make_unique<btMultiBody>(links, mass, moments, !tree.free(), false);
  body_->setLinearDamping(0.0);
  body_->setAngularDamping(0.0);
  body_->setMaxCoordinateVelocity(1e9);  // it would cut them off in silence
  body_->setBaseWorldTransform(base.pose);
  for (int index = 1; index <= links; ++index) set_up(index);
  body_->finalizeMultiDof();
  if (tree.free()) add_collider(base.body, -1);
  for (int index = 1; index <= links; ++index) add_collider(tree.link(index).body, link(index));
  for (int index = 1; index <= links; ++index) {
    if (tree.link(index).velocity < 0) continue;
    const Joint& joint = scene.joints()[*tree.link(index).joint];
    const auto& controls = tree.controls();
    const auto control =
        std::find_if(controls.begin(), controls.end(), [&](const JointControl& of) { return of.joint == &joint; });
    rows_.push_back(
        std::make_unique<BulletJoint>(*body_, link(index), joint, control == controls.end() ? nullptr : &*control));
  }
}

void BulletTree::set_up(int index) {
  const Articulation::Link& of = tree_.link(index);
  const btQuaternion turn = turn_of(of.turn.transpose());
  if (of.velocity < 0) {
    body_->setupFixed(link(index), of.mass, of.moments, link(of.parent), turn, of.pivot, of.arm);
  } else if (of.slides) {
    body_->setupPrismatic(link(index), of.mass, of.moments, link(of.parent), turn, of.axis, of.pivot, of.arm, true);
  } else {
    body_->setupRevolute(link(index), of.mass, of.moments, link(of.parent), turn, of.axis, of.pivot, of.arm, true);
  }
}

void BulletTree::add_collider(std::size_t of_scene, int link) {
  colliders_.push_back(std::make_unique<btMultiBodyLinkCollider>(body_.get(), link));
  btMultiBodyLinkCollider& collider = *colliders_.back();
  collider.setCollisionShape(scene_.collision_shape(of_scene).shape.get());
  collider.setUserIndex(static_cast<int>(of_scene));
  collider.setActivationState(DISABLE_DEACTIVATION);
  if (link < 0) {
    body_->setBaseCollider(&collider);
  } else {
    body_->getLink(link).m_collider = &collider;
  }
}

void BulletTree::restore() {
  if (tree_.free()) {
    const std::vector<double>& velocities = tree_.velocities();
    body_->setBaseWorldTransform(tree_.link(0).pose);
    body_->setBaseVel({velocities[0], velocities[1], velocities[2]});
    body_->setBaseOmega({velocities[3], velocities[4], velocities[5]});
  }
  for (int index = 1; index < static_cast<int>(tree_.links().size()); ++index) {
    const Articulation::Link& of = tree_.link(index);
    if (of.velocity >= 0) {
      body_->setJointPos(link(index), of.position);
      body_->setJointVel(link(index), tree_.velocities()[static_cast<std::size_t>(of.velocity)]);
    } else if (of.position != 0.0) {  // a joint that is rigid where it is: for Bullet a fixed link, put there
      btMultibodyLink& held = body_->getLink(link(index));
      if (of.slides) {
        held.m_eVector = of.pivot + of.turn * (of.axis * of.position);
      } else {
        held.m_zeroRotParentToThis = btQuaternion(of.axis, -of.position) * turn_of(of.turn.transpose());
      }
      held.updateCacheMultiDof();
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

// What pushes it to its velocities is felt by the joints.
void BulletTree::drive_base(double duration) {
  const Velocity velocity = tree_.base_velocity();
  driven_ = moved_pose(tree_.link(0).pose, velocity.linear * duration, velocity.angular * duration);
  body_->addBaseForce((velocity.linear - body_->getBaseVel()) * (heaviness_ / duration));
  body_->addBaseTorque((velocity.angular - body_->getBaseOmega()) * (heaviness_ / duration));
}

void BulletTree::load(const Vector3& gravity, double duration) {
  const btVector3 down = to_bullet(gravity);
  if (tree_.kinematic()) drive_base(duration);
  const int first = tree_.free() && !tree_.kinematic() ? 0 : 1;
  if (first == 0) {
    const Articulation::Link& base = tree_.link(0);
    const Velocity damping = damping_of(scene_.bodies()[base.body], {body_->getBaseVel(), body_->getBaseOmega()},
                                        base.mass, base.moments, base.pose.getBasis(), duration);
    body_->addBaseForce(damping.linear);
    body_->addBaseTorque(damping.angular);
  }
  for (int index = first; index < static_cast<int>(tree_.links().size()); ++index) {
    const Articulation::Link& of = tree_.link(index);
    const btVector3 force = down * of.mass + of.force;
    if (index == 0) {
      body_->addBaseForce(force);
      body_->addBaseTorque(of.torque);
    } else {
      body_->addLinkForce(link(index), force);
      body_->addLinkTorque(link(index), of.torque);
    }
  }
}

void BulletTree::read(State& state) {
  if (tree_.kinematic()) {
    const Velocity velocity = tree_.base_velocity();
    body_->setBaseWorldTransform(driven_);
    body_->setBaseVel(velocity.linear);
    body_->setBaseOmega(velocity.angular);
  }
  if (tree_.free()) {
    const std::size_t base = tree_.link(0).body;
    const BodyState frame = frame_state(scene_.inertial(base), body_->getBaseWorldTransform(),
                                        from_bullet(body_->getBaseVel()), from_bullet(body_->getBaseOmega()));
    StateLayout::write(frame, state.data() + layout_.offset(base));
  }
  for (int index = 1; index < static_cast<int>(tree_.links().size()); ++index) {
    const Articulation::Link& of = tree_.link(index);
    const int offset = layout_.joint_offset(*of.joint);
    if (offset < 0) continue;
    state[offset] = of.velocity >= 0 ? body_->getJointPos(link(index)) : of.position;
    state[offset + 1] = of.velocity >= 0 ? body_->getJointVel(link(index)) : 0.0;
  }
}

}  // namespace energymargin

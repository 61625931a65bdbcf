#include "physics/free_bodies/contact_solver.hpp"

#include <algorithm>

#include "physics/rigid_bodies.hpp"
#include "physics/shapes.hpp"

namespace energymargin {
namespace {

// Of an overlap, the share that a step leaves. So much of the last split impulse is what the next one begins with.
constexpr double overlap_left = 0.8;

Twist twist(const btVector3& linear, const btVector3& angular) {
  return {Eigen::Array2d(linear.x(), angular.x()), Eigen::Array2d(linear.y(), angular.y()),
          Eigen::Array2d(linear.z(), angular.z())};
}

btVector3 linear(const Twist& twist) { return {twist[0][0], twist[1][0], twist[2][0]}; }
btVector3 angular(const Twist& twist) { return {twist[0][1], twist[1][1], twist[2][1]}; }

// Directions in the contact's plane: along the slip, if there is any, and across it.
void set_friction_directions(btManifoldPoint& point, const btVector3& velocity, bool both) {
  const btVector3& normal = point.m_normalWorldOnB;
  const btVector3 slip = velocity - normal * normal.dot(velocity);
  const double squared = slip.length2();
  if (squared <= SIMD_EPSILON) return btPlaneSpace1(normal, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
  point.m_lateralFrictionDir1 = slip * (1.0 / btSqrt(squared));
  if (both) point.m_lateralFrictionDir2 = point.m_lateralFrictionDir1.cross(normal).normalized();
}

}  // namespace

bool ContactSolver::solve(const std::vector<btRigidBody*>& bodies, const std::vector<btPersistentManifold*>& manifolds,
                          const std::vector<Motor>& motors, const btContactSolverInfo& info) {
  add_bodies(bodies, info);
  for (const Motor& motor : motors) add_motor(motor, info);
  for (btPersistentManifold* manifold : manifolds) add_contacts(*manifold, info);
  const bool converged = iterate(info);
  if (audit_.before) add_work(info);
  write_back(info);
  return converged;
}

void ContactSolver::add_bodies(const std::vector<btRigidBody*>& bodies, const btContactSolverInfo& info) {
  moving_.clear();
  rows_.clear(bodies.size());
  for (btRigidBody* body : bodies) {
    const auto index = body_index(*body);
    if (slots_.size() <= index) slots_.resize(index + 1, -1);
    slots_[index] = static_cast<int>(moving_.size());
    const bool gyroscopic = body->getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY;
    moving_.push_back({body, body->getInvMass() * body->getLinearFactor(),
                       gyroscopic ? body->computeGyroscopicImpulseImplicit_Body(info.m_timeStep) : btVector3(0, 0, 0)});
  }
}

// A row along and about each axis that is not locked.
void ContactSolver::add_motor(const Motor& motor, const btContactSolverInfo& info) {
  const int slot = slots_[motor.body];
  btRigidBody& body = *moving_[static_cast<std::size_t>(slot)].rigid;
  if (is_kinematic(body)) return set_velocities(body, motor);
  for (int i = 0; i < 6; ++i) {
    const bool turns = i >= 3;
    const int axis = i % 3;
    if ((turns ? body.getAngularFactor() : body.getLinearFactor())[axis] == 0.0) continue;
    btVector3 direction(0, 0, 0);
    direction[axis] = 1.0;
    MotorRow& row = rows_.add_motor();
    const btVector3 none(0, 0, 0);
    const btVector3 spin = body.getInvInertiaTensorWorld() * direction * body.getAngularFactor();
    row.first.body = slot;
    const double effective_mass = 1.0 / (turns ? direction.dot(spin) : body.getInvMass());
    row.first.scaled = twist(turns ? none : effective_mass * direction, turns ? effective_mass * direction : none);
    row.first.response = turns ? twist(none, spin) : twist(direction * body.getInvMass(), none);
    row.second.body = -1;
    row.inverse_effective_mass = 1.0 / effective_mass;
    row.target = (turns ? motor.angular : motor.linear)[axis] * effective_mass - asked_before(row, true);
    row.impulse = 0.0;
    row.limit = (turns ? motor.torque : motor.force) * info.m_timeStep;
  }
}

void ContactSolver::add_contacts(btPersistentManifold& manifold, const btContactSolverInfo& info) {
  const btCollisionObject& a = *manifold.getBody0();
  const btCollisionObject& b = *manifold.getBody1();
  const int slot_a = slot_of(a);
  const int slot_b = slot_of(b);
  const bool both = info.m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS;
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    btManifoldPoint& point = manifold.getContactPoint(i);
    const Ends ends{slot_a, slot_b, point.getPositionWorldOnA() - a.getWorldTransform().getOrigin(),
                    point.getPositionWorldOnB() - b.getWorldTransform().getOrigin()};
    const std::size_t normal = rows_.normals().size();
    add_normal(point, ends, info);
    const btVector3 friction = point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                               point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
    set_friction_directions(point, velocity(slot_a, ends.arm_a) - velocity(slot_b, ends.arm_b), both);
    add_friction(point, normal, point.m_lateralFrictionDir1, friction, point.m_appliedImpulseLateral1, ends);
    if (both) add_friction(point, normal, point.m_lateralFrictionDir2, friction, point.m_appliedImpulseLateral2, ends);
  }
}

void ContactSolver::add_normal(btManifoldPoint& point, const Ends& ends, const btContactSolverInfo& info) {
  NormalRow& row = rows_.add_normal();
  row.point = &point;
  set_sides(row, point.m_normalWorldOnB, ends);
  const double rate = 1.0 / info.m_timeStep;
  const double gap = point.getDistance();
  const double closing = gap * rate / row.inverse_effective_mass;
  row.target = -asked_before(row, true) - std::max(closing, 0.0);  // up to the touch it may close
  row.split_target = gap > 0.0 ? 0.0 : -info.m_erp2 * closing;
  row.split_impulse = gap > 0.0 ? 0.0 : overlap_left * point.m_prevRHS;
  row.impulse = point.m_appliedImpulse;
  rows_.apply(row);
  rows_.apply_split(row);
}

// It begins with what the friction of the part before, along whatever direction, had along this one.
void ContactSolver::add_friction(const btManifoldPoint& point, std::size_t normal, const btVector3& direction,
                                 const btVector3& before, double& stored, const Ends& ends) {
  FrictionRow& row = rows_.add_friction();
  row.stored = &stored;
  row.friction = point.m_combinedFriction;
  row.normal = normal;
  set_sides(row, direction, ends);
  row.target = -asked_before(row, false);
  row.impulse = before.dot(direction);
  rows_.apply(row);
}

void ContactSolver::set_sides(ContactRow& row, const btVector3& direction, const Ends& ends) const {
  row.inverse_effective_mass = 0.0;
  RowSide* side = &row.first;
  row.second.body = -1;
  if (ends.slot_a >= 0) {
    row.inverse_effective_mass += set_side(*side, ends.slot_a, direction, ends.arm_a);
    side = &row.second;
  }
  if (ends.slot_b >= 0) row.inverse_effective_mass += set_side(*side, ends.slot_b, -direction, ends.arm_b);
  const double effective_mass = 1.0 / row.inverse_effective_mass;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    row.first.scaled[axis] *= effective_mass;
    if (row.second.body >= 0) row.second.scaled[axis] *= effective_mass;
  }
}

// Without the scale yet. Returns the velocity at the point along the direction by an impulse of 1.
double ContactSolver::set_side(RowSide& side, int slot, const btVector3& direction, const btVector3& arm) const {
  const MovingBody& body = moving_[static_cast<std::size_t>(slot)];
  const btVector3 turn = arm.cross(direction);
  const btVector3 spin = body.rigid->getInvInertiaTensorWorld() * turn * body.rigid->getAngularFactor();
  side.body = slot;
  side.scaled = twist(direction, turn);
  side.response = twist(direction * body.inverse_masses, spin);
  return body.rigid->getInvMass() + turn.dot(spin);
}

// The impulse that the velocities before the step ask for, to bring them to zero; in friction Bullet leaves out what
// gyroscopic torques will change.
double ContactSolver::asked_before(const ContactRow& row, bool gyroscopic) const {
  const auto by = [&](const RowSide& side) {
    const MovingBody& body = moving_[static_cast<std::size_t>(side.body)];
    const btVector3& spin = body.rigid->getAngularVelocity();
    return linear(side.scaled).dot(body.rigid->getLinearVelocity()) +
           angular(side.scaled).dot(gyroscopic ? spin + body.gyroscopic : spin);
  };
  return row.second.body >= 0 ? by(row.first) + by(row.second) : by(row.first);
}

btVector3 ContactSolver::velocity(int slot, const btVector3& arm) const {
  if (slot < 0) return {0, 0, 0};
  const MovingBody& body = moving_[static_cast<std::size_t>(slot)];
  return body.rigid->getLinearVelocity() + (body.rigid->getAngularVelocity() + body.gyroscopic).cross(arm);
}

// Whether the last iterations changed little.
bool ContactSolver::iterate(const btContactSolverInfo& info) {
  const auto until_small = [&](auto iterate) {
    for (int i = 0; i < info.m_numIterations; ++i) {
      if (iterate() <= info.m_leastSquaresResidualThreshold) return true;
    }
    return false;
  };
  const bool apart = until_small([this] { return rows_.iterate_split_impulses(); });
  return until_small([this] { return rows_.iterate(); }) && apart;
}

void ContactSolver::write_back(const btContactSolverInfo& info) {
  for (const NormalRow& row : rows_.normals()) {
    row.point->m_appliedImpulse = row.impulse;
    row.point->m_prevRHS = row.split_impulse;  // Bullet keeps it for a point, and has no use for it
  }
  for (const FrictionRow& row : rows_.frictions()) *row.stored = row.impulse;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    btRigidBody& body = *moving_[i].rigid;
    const Twist& change = rows_.change(i);
    body.setLinearVelocity(body.getLinearVelocity() + linear(change));
    body.setAngularVelocity(body.getAngularVelocity() + angular(change) + moving_[i].gyroscopic);
    const btVector3 push = linear(rows_.split(i));
    const btVector3 turn = angular(rows_.split(i));
    if (push.isZero() && turn.isZero()) continue;
    btTransform pose;
    btTransformUtil::integrateTransform(body.getWorldTransform(), push, turn * info.m_splitImpulseTurnErp,
                                        info.m_timeStep, pose);
    body.setWorldTransform(pose);
  }
}

void ContactSolver::add_work(const btContactSolverInfo& info) {
  for (const MotorRow& row : rows_.motors()) audit_.work.motors += work_of(row);
  for (const NormalRow& row : rows_.normals()) {
    audit_.work.contacts += work_of(row);
    audit_.work.motors -= work_on_kinematic(row);
  }
  for (const FrictionRow& row : rows_.frictions()) {
    audit_.work.friction += work_of(row);
    audit_.work.motors -= work_on_kinematic(row);
  }
  // These impulses move bodies and leave their velocities alone.
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Motion::OfBody& loaded = audit_.before->bodies[static_cast<std::size_t>(moving_[i].rigid->getUserIndex())];
    const btVector3 turn = angular(rows_.split(i)) * info.m_splitImpulseTurnErp;
    audit_.work.overlap -= (loaded.force.dot(linear(rows_.split(i))) + loaded.torque.dot(turn)) * info.m_timeStep;
  }
}

double ContactSolver::work_of(const ContactRow& row) const {
  const double scaled = scaled_speed(row.first) + (row.second.body >= 0 ? scaled_speed(row.second) : 0.0);
  return row.impulse * scaled * row.inverse_effective_mass;
}

// A kinematic body keeps none of it: what stands against the impulse is its drive.
double ContactSolver::work_on_kinematic(const ContactRow& row) const {
  const auto scaled = [this](const RowSide& side) {
    const bool kinematic = side.body >= 0 && is_kinematic(*moving_[static_cast<std::size_t>(side.body)].rigid);
    return kinematic ? scaled_speed(side) : 0.0;
  };
  return row.impulse * (scaled(row.first) + scaled(row.second)) * row.inverse_effective_mass;
}

// Half of the sum of the speeds before and after, times the effective mass.
double ContactSolver::scaled_speed(const RowSide& side) const {
  const auto slot = static_cast<std::size_t>(side.body);
  const btRigidBody& body = *moving_[slot].rigid;
  const Motion::OfBody& before = audit_.before->bodies[body_index(body)];
  const btVector3 velocity = body.getLinearVelocity() + linear(rows_.change(slot));
  const btVector3 spin = body.getAngularVelocity() + moving_[slot].gyroscopic + angular(rows_.change(slot));
  return 0.5 * (linear(side.scaled).dot(before.linear + velocity) + angular(side.scaled).dot(before.angular + spin));
}

int ContactSolver::slot_of(const btCollisionObject& object) const {
  const auto index = body_index(object);
  return index < slots_.size() ? slots_[index] : -1;
}

}  // namespace energymargin

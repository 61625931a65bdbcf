#include "physics/articulated/articulated_solver.hpp"

#include <algorithm>
#include <cmath>

#include "physics/rigid_bodies.hpp"

namespace energymargin {
namespace {

constexpr double stop_reach = 0.05;  // a stop takes part from this gap on [rad or m] ...
constexpr double stop_steps = 4.0;   // ... or if a joint of the tree could get there in so many steps

btVector3 vector(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

void write(const btVector3& from, double* numbers) {
  for (int i = 0; i < 3; ++i) numbers[i] = from[i];
}

bool gyroscopic(const btRigidBody& body) { return body.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY; }

}  // namespace

ArticulatedSolver::ArticulatedSolver(const std::vector<btRigidBody*>& bodies, const std::vector<Articulation*>& trees,
                                     std::vector<MimicConstraint>& mimics, ImpulseAudit& audit)
    : mimics_(mimics), audit_(audit) {
  const auto add = [this](std::size_t pairs, btRigidBody* body, std::size_t tree) {
    movers_.push_back({{velocities_, pairs}, body, tree});
    velocities_ += 2 * pairs;
  };
  const auto name = [this](const btCollisionObject& object) {
    slots_.resize(std::max(slots_.size(), body_index(object) + 1), -1);
    slots_[body_index(object)] = static_cast<int>(movers_.size()) - 1;
  };
  for (btRigidBody* body : bodies) {
    add(velocities_of_free_body / 2, body, 0);
    name(*body);
  }
  for (Articulation* tree : trees) {
    trees_.emplace_back(*tree);
    add(trees_.back().size() / 2, nullptr, trees_.size() - 1);
    for (const auto& collider : tree->colliders()) name(*collider);
  }
}

// A drive that would be beyond its torque limit becomes a row, and all is solved again.
bool ArticulatedSolver::solve(const StepPart& part, const btVector3& gravity) {
  const btContactSolverInfo& info = part.solver;
  for (TreeDynamics& tree : trees_) tree.update(gravity);
  for (const Motor& motor : part.motors) drive(motor);
  bool converged = false;
  do {
    start(info.m_timeStep);
    for (const Motor& motor : part.motors) add_motor(motor, info.m_timeStep);
    for (std::size_t i = 0; i < trees_.size(); ++i) add_controls(i, info);
    for (MimicConstraint& mimic : mimics_) add_mimic(mimic, info);
    for (btPersistentManifold* manifold : part.touching) add_contacts(*manifold, info);
    converged =
        rows_.solve(info.m_numIterations, info.m_numNonContactInnerIterations, info.m_leastSquaresResidualThreshold);
  } while (update_limits(info.m_timeStep));
  if (audit_.before) add_work(info);
  write_back(info);
  return converged;
}

bool ArticulatedSolver::is_kinematic(const Mover& mover) const {
  return mover.body ? energymargin::is_kinematic(*mover.body) : trees_[mover.tree].tree().kinematic();
}

// Gives a kinematic body the velocities of its motor.
void ArticulatedSolver::drive(const Motor& motor) {
  const Mover& mover = mover_of(motor.body);
  if (!is_kinematic(mover)) return;
  if (mover.body) return set_velocities(*mover.body, motor);
  trees_[mover.tree].drive_base(motor.linear, motor.angular);
}

void ArticulatedSolver::start(double duration) {
  rows_.clear(velocities_);
  for (const Mover& mover : movers_) {
    double* velocities = rows_.velocities() + mover.span.begin;
    if (!mover.body) {
      trees_[mover.tree].start(duration, velocities);
      continue;
    }
    const btRigidBody& body = *mover.body;
    btVector3 spin = body.getAngularVelocity();
    if (gyroscopic(body)) spin += body.computeGyroscopicImpulseImplicit_Body(duration);
    write(body.getLinearVelocity(), velocities);
    write(spin, velocities + 3);
  }
}

template <typename Jacobian>
VelocityRow ArticulatedSolver::row(const Mover* a, const Mover* b, const Jacobian& jacobian) {
  const auto span = [](const Mover* mover) { return mover ? mover->span : VelocitySpan{}; };
  const auto response = [&](bool of_a, const double* of_span, double* changes) {
    respond(of_a ? *a : *b, of_span, changes);
  };
  return rows_.row(span(a), span(b), jacobian, response);
}

void ArticulatedSolver::respond(const Mover& mover, const double* jacobian, double* response) const {
  if (!mover.body) return trees_[mover.tree].respond(jacobian, response);
  const btRigidBody& body = *mover.body;
  write(vector(jacobian) * body.getInvMass() * body.getLinearFactor(), response);
  write(body.getInvInertiaTensorWorld() * vector(jacobian + 3) * body.getAngularFactor(), response + 3);
}

// A row along and about each axis that is not locked.
void ArticulatedSolver::add_motor(const Motor& motor, double duration) {
  const Mover& mover = mover_of(motor.body);
  if (is_kinematic(mover)) return;
  for (int i = 0; i < velocities_of_free_body; ++i) {
    const bool turns = i >= 3;
    const int axis = i % 3;
    if (mover.body && (turns ? mover.body->getAngularFactor() : mover.body->getLinearFactor())[axis] == 0.0) continue;
    VelocityRow made = row(&mover, nullptr, [i](double* of_body, double*) { of_body[i] = 1.0; });
    made.target = (turns ? motor.angular : motor.linear)[axis];
    made.high = (turns ? motor.torque : motor.force) * duration;
    made.low = -made.high;
    rows_.start(made, 0.0);
    rows_.motors.push_back(made);
  }
}

// A joint that hits its stop speeds up its neighbours within the same step.
void ArticulatedSolver::add_controls(std::size_t tree, const btContactSolverInfo& info) {
  Articulation& joints = trees_[tree].tree();
  const Mover& mover = mover_of_tree(tree);
  const double* velocities = rows_.velocities() + mover.span.begin;
  double fastest = 0.0;
  for (const JointControl& control : joints.controls()) {
    fastest = std::max(fastest, std::abs(velocities[control.velocity]));
  }
  const double reach = std::max(stop_reach, stop_steps * info.m_timeStep * fastest);
  for (JointControl& control : joints.controls()) {
    const double position = joints.links()[static_cast<std::size_t>(control.link)].position;
    const double lower = position - control.joint->lower;
    const double upper = control.joint->upper - position;
    if (control.at_limit) add_drive(mover, control, position, info);
    if (lower < reach) add_stop(mover, control, 1.0, lower, control.lower_impulse, info);
    if (upper < reach) add_stop(mover, control, -1.0, upper, control.upper_impulse, info);
  }
}

// impulse = pull - resistance * speed, within the limit.
void ArticulatedSolver::add_drive(const Mover& mover, JointControl& control, double position,
                                  const btContactSolverInfo& info) {
  const double duration = info.m_timeStep;
  VelocityRow made = row(&mover, nullptr, [&](double* of_tree, double*) { of_tree[control.velocity] = 1.0; });
  made.softness = 1.0 / control.resistance(duration);
  made.target = control.pull(duration, position) * made.softness;
  made.high = control.impulse_limit(duration);
  made.low = -made.high;
  made.stored = &control.drive_impulse;
  rows_.start(made, control.drive_impulse * info.m_articulatedWarmstartingFactor);
  rows_.joints.push_back(made);
}

// The joint may not cross its stop in this step; beyond it, it may not go on. Bringing it back would speed it up.
void ArticulatedSolver::add_stop(const Mover& mover, const JointControl& control, double direction, double gap,
                                 double& stored, const btContactSolverInfo& info) {
  VelocityRow made = row(&mover, nullptr, [&](double* of_tree, double*) { of_tree[control.velocity] = direction; });
  made.target = -std::max(gap, 0.0) / info.m_timeStep;
  made.stored = &stored;
  rows_.start(made, stored * info.m_articulatedWarmstartingFactor);
  rows_.joints.push_back(made);
}

void ArticulatedSolver::add_mimic(MimicConstraint& mimic, const btContactSolverInfo& info) {
  const auto link = [this](const MimicConstraint::End& end) -> const Articulation::Link& {
    return trees_[end.tree].tree().links()[static_cast<std::size_t>(end.link)];
  };
  const Articulation::Link& follower = link(mimic.follower);
  const Articulation::Link& followed = link(mimic.followed);
  const double multiplier = mimic.mimic.multiplier;
  VelocityRow made = row(&mover_of_tree(mimic.follower.tree), &mover_of_tree(mimic.followed.tree),
                         [&](double* of_follower, double* of_followed) {
                           of_follower[follower.velocity] += 1.0;
                           of_followed[followed.velocity] -= multiplier;
                         });
  const double error = follower.position - multiplier * followed.position - mimic.mimic.offset;
  made.target = -info.m_erp2 * error / info.m_timeStep;
  made.low = -made.high;
  made.stored = &mimic.impulse;
  rows_.start(made, mimic.impulse * info.m_articulatedWarmstartingFactor);
  rows_.joints.push_back(made);
}

void ArticulatedSolver::add_contacts(btPersistentManifold& manifold, const btContactSolverInfo& info) {
  const auto end = [this](const btCollisionObject& object) {
    const std::size_t body = body_index(object);
    End made;
    if (body >= slots_.size() || slots_[body] < 0) return made;
    made.mover = &mover_of(body);
    if (!made.mover->body) made.link = trees_[made.mover->tree].tree().link_of(object);
    return made;
  };
  End a = end(*manifold.getBody0());
  End b = end(*manifold.getBody1());
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    btManifoldPoint& point = manifold.getContactPoint(i);
    a.point = point.getPositionWorldOnA();
    b.point = point.getPositionWorldOnB();
    add_contact(point, a, b, info);
  }
}

// Links that overlap with another body are moved out by a velocity, free bodies by split impulses. The directions of
// friction are those of the step before, as far as the normal is, so that its impulses go on.
void ArticulatedSolver::add_contact(btManifoldPoint& point, const End& a, const End& b,
                                    const btContactSolverInfo& info) {
  const bool has_link = (a.mover && !a.mover->body) || (b.mover && !b.mover->body);
  const double gap = point.getDistance();
  const double recovery = gap < 0.0 ? -gap * info.m_erp2 / info.m_timeStep : 0.0;
  const std::size_t index = rows_.normals.size();
  VelocityRow normal = contact_row(a, b, point.m_normalWorldOnB, point.m_appliedImpulse);
  normal.target = gap > 0.0 ? -gap / info.m_timeStep : has_link ? recovery : 0.0;
  rows_.start(normal, point.m_appliedImpulse * info.m_warmstartingFactor);
  rows_.normals.push_back(normal);
  if (recovery > 0.0 && !has_link) rows_.splits.push_back({index, recovery});
  btPlaneSpace1(point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
  VelocityRow first = contact_row(a, b, point.m_lateralFrictionDir1, point.m_appliedImpulseLateral1);
  VelocityRow second = contact_row(a, b, point.m_lateralFrictionDir2, point.m_appliedImpulseLateral2);
  first.low = second.low = -first.high;
  rows_.start(first, point.m_appliedImpulseLateral1 * info.m_warmstartingFactor);
  rows_.start(second, point.m_appliedImpulseLateral2 * info.m_warmstartingFactor);
  rows_.frictions.push_back({first, second, point.m_combinedFriction, index});
}

VelocityRow ArticulatedSolver::contact_row(const End& a, const End& b, const btVector3& direction, double& stored) {
  VelocityRow made = row(a.mover, b.mover, [&](double* of_a, double* of_b) {
    if (a.mover) add(a, direction, of_a);
    if (b.mover) add(b, -direction, of_b);
  });
  made.stored = &stored;
  return made;
}

void ArticulatedSolver::add(const End& end, const btVector3& impulse, double* jacobian) const {
  if (!end.mover->body) return trees_[end.mover->tree].add(end.link, end.point, impulse, jacobian);
  write(impulse, jacobian);
  write((end.point - end.mover->body->getCenterOfMassPosition()).cross(impulse), jacobian + 3);
}

// Whether a drive is at its limit, which was not known.
bool ArticulatedSolver::update_limits(double duration) {
  bool found = false;
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    Articulation& tree = trees_[i].tree();
    const double* velocities = rows_.velocities() + mover_of_tree(i).span.begin;
    for (JointControl& control : tree.controls()) {
      if (!control.drives() || control.at_limit) continue;
      const double position = tree.links()[static_cast<std::size_t>(control.link)].position;
      control.drive_impulse =
          control.pull(duration, position) - control.resistance(duration) * velocities[control.velocity];
      control.at_limit = std::abs(control.drive_impulse) > control.impulse_limit(duration);
      found = found || control.at_limit;
    }
  }
  return found;
}

void ArticulatedSolver::write_back(const btContactSolverInfo& info) {
  const auto store = [](const VelocityRow& row) { *row.stored = row.impulse; };
  for (const VelocityRow& made : rows_.joints) store(made);
  for (const VelocityRow& made : rows_.normals) store(made);
  for (const VelocityRows::Friction& friction : rows_.frictions) {
    store(friction.first);
    store(friction.second);
  }
  for (const Mover& mover : movers_) {
    const double* velocities = rows_.velocities() + mover.span.begin;
    if (!mover.body) {
      Articulation& tree = trees_[mover.tree].tree();
      std::copy_n(velocities, tree.velocities().size(), tree.velocities().begin());
      for (JointControl& control : tree.controls()) {
        control.at_limit =
            control.at_limit && std::abs(control.drive_impulse) >= control.impulse_limit(info.m_timeStep);
      }
      continue;
    }
    btRigidBody& body = *mover.body;
    body.setLinearVelocity(vector(velocities));
    body.setAngularVelocity(vector(velocities + 3));
    const btVector3 push = vector(rows_.split_velocities() + mover.span.begin);
    const btVector3 turn = vector(rows_.split_velocities() + mover.span.begin + 3);
    if (push.isZero() && turn.isZero()) continue;
    btTransform pose;
    btTransformUtil::integrateTransform(body.getWorldTransform(), push, turn * info.m_splitImpulseTurnErp,
                                        info.m_timeStep, pose);
    body.setWorldTransform(pose);
  }
}

// Each impulse times the mean of the speeds along it before the step and after it. Split impulses move bodies and leave
// their velocities alone.
void ArticulatedSolver::add_work(const btContactSolverInfo& info) {
  std::vector<double> before(velocities_, 0.0);
  for (const Mover& mover : movers_) {
    double* velocities = before.data() + mover.span.begin;
    if (!mover.body) {
      const std::vector<double>& of_tree = audit_.before->trees[mover.tree];
      std::copy(of_tree.begin(), of_tree.end(), velocities);
      continue;
    }
    const Motion::OfBody& loaded = audit_.before->bodies[body_index(*mover.body)];
    write(loaded.linear, velocities);
    write(loaded.angular, velocities + 3);
    const double* split = rows_.split_velocities() + mover.span.begin;
    const btVector3 turn = vector(split + 3) * info.m_splitImpulseTurnErp;
    audit_.work.overlap -= (loaded.force.dot(vector(split)) + loaded.torque.dot(turn)) * info.m_timeStep;
  }
  const auto work_of = [&](const VelocityRow& made) {
    return made.impulse * 0.5 * (rows_.speed(made, before.data()) + rows_.speed(made, rows_.velocities()));
  };
  for (const VelocityRow& made : rows_.motors) audit_.work.motors += work_of(made);
  for (const VelocityRow& made : rows_.joints) audit_.work.joints += made.softness == 0.0 ? work_of(made) : 0.0;
  for (const VelocityRow& made : rows_.normals) audit_.work.contacts += work_of(made);
  for (const VelocityRows::Friction& friction : rows_.frictions) {
    audit_.work.friction += work_of(friction.first) + work_of(friction.second);
  }
  add_work_on_kinematic(info.m_timeStep, before);
}

// Kinematic bodies keep nothing of the impulses on them, nor of what moves their links: all that comes from their
// drives.
void ArticulatedSolver::add_work_on_kinematic(double duration, const std::vector<double>& before) {
  std::vector<double> prescribed(velocities_, 0.0);  // mean velocities of kinematic bodies
  for (const Mover& mover : movers_) {
    if (!is_kinematic(mover)) continue;
    const double* from = before.data() + mover.span.begin;
    const double* to = rows_.velocities() + mover.span.begin;
    for (std::size_t i = 0; i < velocities_of_free_body; ++i)
      prescribed[mover.span.begin + i] = 0.5 * (from[i] + to[i]);
    if (!mover.body) audit_.work.motors += trees_[mover.tree].work_on_base(duration, from, to);
  }
  const auto work_of = [&](const VelocityRow& made) { return made.impulse * rows_.speed(made, prescribed.data()); };
  for (const VelocityRow& made : rows_.normals) audit_.work.motors -= work_of(made);
  for (const VelocityRows::Friction& friction : rows_.frictions) {
    audit_.work.motors -= work_of(friction.first) + work_of(friction.second);
  }
}

}  // namespace energymargin

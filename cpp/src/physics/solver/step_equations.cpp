#include "physics/solver/step_equations.hpp"

#include <algorithm>
#include <cmath>

#include "physics/sweep.hpp"

namespace energymargin {
namespace {

constexpr double stop_reach = 0.05;  // a stop takes part from this gap on [rad or m] ...
constexpr double stop_steps = 4.0;   // ... or if a joint of the tree could get there in so many steps

// A body whose spin changes by less than this share of itself coasts as it is; the midpoint rule goes on for as long as
// it changes by more.
constexpr double steady_spin = 1e-9;
constexpr int midpoint_iterations = 8;

// A vector after a turn by a rotation vector [rad] (Rodrigues 1840).
btVector3 rotated(const btVector3& vector, const btVector3& turn) {
  const double squared = turn.length2();
  double sine = 1.0 - squared / 6.0, rest = 0.5 - squared / 24.0;  // first terms, for less than a thousandth
  if (squared > 1e-6) {
    const double angle = std::sqrt(squared);
    const double half = std::sin(0.5 * angle);
    sine = 2.0 * half * std::cos(0.5 * angle) / angle;
    rest = 2.0 * half * half / squared;
  }
  const btVector3 across = turn.cross(vector);
  return vector + sine * across + rest * turn.cross(across);
}

}  // namespace

StepEquations::StepEquations(const Scene& scene, MovingBodies& bodies, ImpulseAudit& audit)
    : bodies_(bodies), audit_(audit), gravity_(to_bullet(scene.gravity())), rigid_of_(scene.bodies().size(), -1) {
  for (const Body& body : scene.bodies()) masses_.push_back(body.fixed() ? 0.0 : body.mass);
  find_axes(scene);
  for (const auto& tree : bodies.trees()) trees_.emplace_back(*tree);
  for (const MimicConstraint& mimic : bodies.mimics()) {
    trees_[mimic.follower.tree].couple();
    trees_[mimic.followed.tree].couple();
  }
  tree_movers_.resize(trees_.size(), -1);
  tree_pushed_.resize(trees_.size());
  tree_ends_.resize(trees_.size());
}

void StepEquations::find_axes(const Scene& scene) {
  for (btRigidBody* body : bodies_.rigids().moving()) {
    RigidMover made{body};
    const Body& of_scene = scene.bodies()[body_index(*body)];
    for (int axis = 0; axis < 6 && !of_scene.kinematic; ++axis) {
      const double factor = axis < 3 ? of_scene.linear_factor[axis] : of_scene.angular_factor[axis - 3];
      if (factor != 0.0) made.axes.push_back(axis);
    }
    rigid_of_[body_index(*body)] = static_cast<int>(rigids_.size());
    rigids_.push_back(made);
  }
}

bool StepEquations::solve(const Substep& substep) {
  solver_.clear();
  kinds_.clear();
  contact_points_.clear();
  for (TreeDynamics& tree : trees_) tree.keep_base();
  for (const Motor& motor : substep.motors) drive_kinematic(motor);
  for (std::size_t i = 0; i < rigids_.size(); ++i) add_rigid(i, substep.duration);
  for (std::size_t i = 0; i < trees_.size(); ++i) add_tree(i, substep);
  for (const Motor& motor : substep.motors) add_motor(motor, substep.duration);
  for (const MimicConstraint& mimic : bodies_.mimics()) add_mimic(mimic, substep);
  for (std::size_t i = 0; i < substep.contacts.size(); ++i) {
    const ContactPoint& point = substep.contacts[i];
    if (mover_of(point.a) < 0 && mover_of(point.b) < 0) continue;
    if (add_contact(point, substep)) contact_points_.push_back(i);
  }
  bool converged = solver_.solve(substep.iterations, substep.tolerance);
  if (update_bends(substep)) converged = solver_.solve_again(substep.iterations, substep.tolerance);
  for (std::size_t i = 0; i < rigids_.size(); ++i) set_rigid(i, substep.duration);
  for (std::size_t i = 0; i < trees_.size(); ++i) set_tree(i, substep.duration);
  return converged;
}

int StepEquations::mover_of(std::size_t body) const {
  const auto& tree = bodies_.tree_of(body);
  if (tree) return tree_movers_[*tree];
  return is_rigid(body) ? rigid(body).mover : -1;
}

// A kinematic body has the velocities of its motor from now on.
void StepEquations::drive_kinematic(const Motor& motor) {
  if (const auto& tree = bodies_.tree_of(motor.body)) {
    if (trees_[*tree].tree().kinematic()) trees_[*tree].drive_base(motor.linear, motor.angular);
    return;
  }
  btRigidBody& body = *rigid(motor.body).body;
  if (!is_kinematic(body)) return;
  body.setLinearVelocity(motor.linear * body.getLinearFactor());  // not along and about locked axes
  body.setAngularVelocity(motor.angular * body.getAngularFactor());
}

void StepEquations::add_rigid(std::size_t i, double duration) {
  RigidMover& rigid = rigids_[i];
  const btRigidBody& body = *rigid.body;
  rigid.turning.setZero();
  if (is_kinematic(body)) return;
  const int count = static_cast<int>(rigid.axes.size());
  rigid.mover = solver_.add_mover(count);
  const btMatrix3x3 inertia = bodies_.rigids().inertia(i);
  const double mass = 1.0 / body.getInvMass();
  double* const numbers = solver_.inertia(rigid.mover);
  double* const velocities = solver_.velocities(rigid.mover);
  for (int row = 0; row < count; ++row) {
    const int axis = rigid.axes[static_cast<std::size_t>(row)];
    velocities[row] = axis < 3 ? body.getLinearVelocity()[axis] : body.getAngularVelocity()[axis - 3];
    if (axis < 3) {
      numbers[row * count + row] = mass;
      continue;
    }
    for (int column = 0; column < count; ++column) {
      const int other = rigid.axes[static_cast<std::size_t>(column)];
      if (other >= 3) numbers[row * count + column] = inertia[axis - 3][other - 3];
    }
  }
  kick(i, duration, solver_.free(rigid.mover));
  if (count == 6) find_turning(i, duration);
}

// Velocities after the loads of the substep.
void StepEquations::kick(std::size_t i, double duration, double* free) const {
  const RigidMover& rigid = rigids_[i];
  const btRigidBody& body = *rigid.body;
  const btVector3 linear = bodies_.rigids().acceleration(i) * duration;
  const btVector3 twist = bodies_.rigids().torque(i) * duration;
  int turns[3] = {0, 0, 0};
  int count = 0;
  for (const int axis : rigid.axes) {
    if (axis >= 3) turns[count++] = axis - 3;
  }
  btVector3 change(0, 0, 0);
  if (!twist.isZero() && count == 3) {
    const btMatrix3x3& axes = body.getWorldTransform().getBasis();
    change = axes * (twist * axes / bodies_.rigids().moments(i));
  } else if (!twist.isZero()) {
    const btMatrix3x3 inertia = bodies_.rigids().inertia(i);
    const int x = turns[0], y = turns[1];
    if (count == 1) {
      change[x] = twist[x] / inertia[x][x];
    } else if (count == 2) {
      const double determinant = inertia[x][x] * inertia[y][y] - inertia[x][y] * inertia[y][x];
      change[x] = (inertia[y][y] * twist[x] - inertia[x][y] * twist[y]) / determinant;
      change[y] = (inertia[x][x] * twist[y] - inertia[y][x] * twist[x]) / determinant;
    }
  }
  for (std::size_t row = 0; row < rigid.axes.size(); ++row) {
    const int axis = rigid.axes[row];
    free[row] = axis < 3 ? body.getLinearVelocity()[axis] + linear[axis]
                         : body.getAngularVelocity()[axis - 3] + change[axis - 3];
  }
}

// Zero where the spin stays what it is, or nearly so.
void StepEquations::find_turning(std::size_t i, double duration) {
  const btRigidBody& body = *rigids_[i].body;
  const btMatrix3x3& axes = body.getWorldTransform().getBasis();
  const btVector3& moments = bodies_.rigids().moments(i);
  const btVector3 local = body.getAngularVelocity() * axes;
  const btVector3 turning = local.cross(moments * local) / moments;
  if (turning.length2() * duration * duration <= steady_spin * steady_spin * local.length2()) return;
  rigids_[i].turning = axes * turning;
}

// A body that turns freely keeps its angular momentum, and by the midpoint rule its energy (Simo and Wong 1991).
void StepEquations::coast(std::size_t i, double duration, btVector3& mean) {
  RigidMover& rigid = rigids_[i];
  const btMatrix3x3& axes = rigid.body->getWorldTransform().getBasis();
  const btVector3& moments = bodies_.rigids().moments(i);
  const btVector3 momentum = bodies_.rigids().inertia(i) * rigid.pushed.angular;
  const auto spin_after = [&](const btVector3& turn) {
    const btVector3 turned_back = rotated(momentum, -turn) * axes / moments;
    return rotated(axes * turned_back, turn);
  };
  for (int iteration = 0; iteration < midpoint_iterations; ++iteration) {
    const btVector3 before = mean;
    mean = spin_after(mean * (0.5 * duration));
    if ((mean - before).length2() <= steady_spin * steady_spin * mean.length2()) break;
  }
  rigid.spin = spin_after(mean * duration);
}

// Whether nothing constrains a tree in this substep, and nothing drives it.
bool StepEquations::is_alone(std::size_t index, const Substep& substep) const {
  const Articulation& tree = trees_[index].tree();
  if (trees_[index].drives() || tree.kinematic()) return false;
  const auto is_here = [&](std::size_t body) { return bodies_.tree_of(body) == index; };
  for (const Articulation::Link& link : tree.links()) {
    if (!link.force.isZero() || !link.torque.isZero()) return false;
  }
  for (const ContactPoint& point : substep.contacts) {
    if (is_here(point.a) || is_here(point.b)) return false;
  }
  for (const Motor& motor : substep.motors) {
    if (is_here(motor.body)) return false;
  }
  for (const MimicConstraint& mimic : bodies_.mimics()) {
    if (mimic.follower.tree == index || mimic.followed.tree == index) return false;
  }
  return std::all_of(
      bodies_.trees()[index]->controls().begin(), bodies_.trees()[index]->controls().end(),
      [](const JointControl& control) { return std::isinf(control.joint->lower) && std::isinf(control.joint->upper); });
}

// A joint that hits its stop speeds up its neighbours within the same step.
void StepEquations::add_tree(std::size_t i, const Substep& substep) {
  TreeDynamics& dynamics = trees_[i];
  Articulation& tree = dynamics.tree();
  dynamics.prepare(substep.duration, gravity_, is_alone(i, substep));
  const std::size_t skipped = dynamics.prescribed();
  const std::size_t count = dynamics.count() - skipped;
  tree_movers_[i] = -1;
  if (count == 0) return;
  const int mover = tree_movers_[i] = solver_.add_mover(static_cast<int>(count));
  for (std::size_t row = 0; row < count; ++row) {
    std::copy_n(dynamics.inertia_row(skipped + row) + skipped, count, solver_.inertia(mover) + row * count);
    solver_.free(mover)[row] = dynamics.kicked()[skipped + row];
    solver_.velocities(mover)[row] = tree.velocities()[skipped + row];
  }
  double fastest = 0.0;
  for (const JointControl& control : tree.controls()) {
    const auto velocity = static_cast<std::size_t>(control.velocity);
    fastest = std::max({fastest, std::abs(dynamics.kicked()[velocity]), std::abs(tree.velocities()[velocity])});
  }
  const double reach = std::max(stop_reach, stop_steps * substep.duration * fastest);
  for (const JointControl& control : tree.controls()) {
    const double position = tree.links()[static_cast<std::size_t>(control.link)].position;
    const double lower = position - control.joint->lower;
    const double upper = control.joint->upper - position;
    if (control.drives() && control.limited()) add_drive(i, control, position, substep.duration);
    if (lower < reach) add_stop(i, control, 1.0, lower, substep);
    if (upper < reach) add_stop(i, control, -1.0, upper, substep);
  }
}

void StepEquations::set_rigid(std::size_t i, double duration) {
  RigidMover& rigid = rigids_[i];
  const btRigidBody& body = *rigid.body;
  rigid.pushed = {body.getLinearVelocity(), body.getAngularVelocity()};
  Velocity recovery;
  for (std::size_t row = 0; row < rigid.axes.size(); ++row) {
    const int axis = rigid.axes[row];
    (axis < 3 ? rigid.pushed.linear[axis] : rigid.pushed.angular[axis - 3]) = solver_.velocities(rigid.mover)[row];
    (axis < 3 ? recovery.linear[axis] : recovery.angular[axis - 3]) = solver_.recovery(rigid.mover)[row];
  }
  Velocity way = rigid.pushed;
  rigid.spin = rigid.pushed.angular;
  if (!rigid.turning.isZero()) coast(i, duration, way.angular);
  bodies_.rigids().set_way(i, {way.linear + recovery.linear, way.angular + recovery.angular});
}

void StepEquations::set_tree(std::size_t i, double duration) {
  TreeDynamics& dynamics = trees_[i];
  std::vector<double>& ways = dynamics.tree().ways();
  const auto skipped = static_cast<std::ptrdiff_t>(dynamics.prescribed());
  tree_pushed_[i] = dynamics.kicked();
  if (tree_movers_[i] >= 0) {
    std::copy_n(solver_.velocities(tree_movers_[i]), solver_.count(tree_movers_[i]), tree_pushed_[i].begin() + skipped);
  }
  tree_ends_[i] = tree_pushed_[i];
  dynamics.coast(duration, tree_ends_[i], ways);
  if (tree_movers_[i] < 0) return;
  const double* recovery = solver_.recovery(tree_movers_[i]);
  for (std::size_t k = dynamics.prescribed(); k < dynamics.count(); ++k) ways[k] += recovery[k - dynamics.prescribed()];
}

// Work is done before all coasts. `share` is that of their way that bodies can go.
void StepEquations::commit(const Substep& substep, double share) {
  write_contacts(substep.contacts);
  for (const RigidMover& rigid : rigids_) {
    rigid.body->setLinearVelocity(rigid.pushed.linear);
    rigid.body->setAngularVelocity(rigid.pushed.angular);
  }
  for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i].tree().velocities() = tree_pushed_[i];
  if (audit_.before) {
    add_work(substep, share);
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      audit_.work.gravity += trees_[i].gravity_beside(substep.duration, audit_.before->trees[i], tree_ends_[i]);
    }
  }
  if (share < 1.0) return;  // what does not get to where it coasts gains no energy of it
  for (const RigidMover& rigid : rigids_) rigid.body->setAngularVelocity(rigid.spin);
  for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i].tree().velocities() = tree_ends_[i];
}

}  // namespace energymargin

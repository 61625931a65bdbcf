#include "physics/native/step_equations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/portable.hpp"
#include "scene/body_constants.hpp"

namespace energymargin {
namespace {

// A spin that changes by less than this share of itself is steady; the midpoint rule goes on until it is.
constexpr double steady_spin = 1e-9;
constexpr int midpoint_iterations = 8;

// A load presses contacts in by no more than this [m/s], nor bodies of a thin plate by more than this share of what
// stops their way.
constexpr double most_given = 1e-3, most_pressed = 0.5;

// Solutions of a substep for how ways bend.
constexpr int most_corrections = 4;

// A vector after a turn by a rotation vector [rad] (Rodrigues 1840).
btVector3 rotated(const btVector3& vector, const btVector3& turn) {
  const double squared = turn.length2();
  double sine = 1.0 - squared / 6.0, rest = 0.5 - squared / 24.0;  // first terms, for less than a thousandth
  if (squared > 1e-6) {
    const double angle = std::sqrt(squared);
    const double half = portable::sin(0.5 * angle);
    sine = 2.0 * half * portable::cos(0.5 * angle) / angle;
    rest = 2.0 * half * half / squared;
  }
  const btVector3 across = turn.cross(vector);
  return vector + sine * across + rest * turn.cross(across);
}

}  // namespace

StepEquations::StepEquations(const Scene& scene, MovingBodies& bodies)
    : scene_(scene),
      surfaces_(scene.has_surfaces()),
      locks_(bodies.locks()),
      bodies_(bodies),
      trees_(bodies.trees().size()) {
  const Stepping& stepping = scene.stepping();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const double half = scene.smallest_half_extent(i), margin = collision_margin(half, stepping.margin);
    const double allowed = allowed_penetration(2.0 * margin, half, half);
    gives_.push_back(std::min(most_given, most_pressed * error_share * allowed / stepping.step));
  }
}

// Contacts that stay open need no rows. Where that was not so, they get them: so all is as if they had had them.
bool StepEquations::solve(const Substep& substep) {
  closing_.clear();
  bool converged = solve_rows(substep);
  while (solver_.closes()) {
    for (const OpenContacts& each : solver_.open()) {
      if (each.closes) closing_.emplace_back(each.a, each.b);
    }
    converged = solve_rows(substep);
  }
  return converged;
}

bool StepEquations::solve_rows(const Substep& substep) {
  solver_.clear();
  contact_points_.clear();
  loop_rows_.clear();
  bent_rows_.clear();
  release_locked(substep.contacts);
  for (FreeBody& body : bodies_.free()) add_free(body, substep.duration);
  for (const FreeBody& body : bodies_.free()) hold_released(body);
  for (std::size_t i = 0; i < trees_.size(); ++i) add_tree(i, substep);
  for (const Motor& motor : substep.motors) add_motor(motor, substep.duration);
  for (const auto& mimics : bodies_.mimics()) {
    for (const MimicConstraint& mimic : mimics) add_mimic(mimic, substep.duration);
  }
  for (const TendonControl& tendon : bodies_.tendons()) add_tendon(tendon, substep.duration);
  for (const LoopConstraint& loop : bodies_.loops()) add_loop(loop, substep.duration);
  const bool blow = substep.bounces == Bounces::now;
  if (blow) find_lags(substep.duration);
  for (std::size_t i = 0; i < substep.contacts.size(); ++i) {
    const ContactPoint& point = substep.contacts[i];
    if (blow && !in_blow_[i]) continue;
    if (mover_of(point.a) < 0 && mover_of(point.b) < 0) continue;
    if (stays_open(point, substep)) continue;
    if (add_contact(point, substep)) contact_points_.push_back(i);
  }
  const Stepping& stepping = scene_.stepping();
  bool converged = solver_.solve(stepping.most_iterations(), stepping.residual());
  if (update_bends(substep)) converged = solver_.solve(stepping.most_iterations(), stepping.residual(), true);
  if (blow) converged = weaken_bounces(converged);
  set_all(substep.duration);
  for (int i = 0; i < most_corrections; ++i) {
    const bool bent = straighten_ways(substep.duration);
    if (!close_loops(substep.duration) && !bent) break;
    converged = solver_.solve(stepping.most_iterations(), stepping.residual(), true);
    set_all(substep.duration);
  }
  solver_.recover();
  add_recovery(substep.duration);
  if (!blow && surfaces_ && find_drifts(substep.duration)) add_drifts();
  return converged;
}

void StepEquations::set_all(double duration) {
  for (FreeBody& body : bodies_.free()) set_free(body, duration);
  for (std::size_t i = 0; i < trees_.size(); ++i) set_tree(i, duration);
}

// What is put right beside the velocities changes the ways alone, but for what keeps the momenta of a tree; no velocity
// may pay for how they bend by it.
void StepEquations::add_recovery(double duration) {
  for (FreeBody& body : bodies_.free()) {
    for (std::size_t k = 0; k < body.unlocked; ++k) body.way[body.axes[k]] += solver_.recovery(body.mover)[k];
  }
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (trees_[i].mover < 0) continue;
    tree(i).add_to_ways(solver_.recovery(trees_[i].mover), duration, trees_[i].end);
  }
}

void StepEquations::add_drifts() {
  for (FreeBody& body : bodies_.free()) {
    if (body.mover < 0) continue;
    const double* const drift = drifts_.data() + solver_.begin(body.mover);
    for (std::size_t k = 0; k < body.axes.size() && body.axes[k] < 3; ++k) body.way[body.axes[k]] += drift[k];
  }
}

int StepEquations::mover_of(std::size_t body) const {
  if (const auto& link = bodies_.link(body)) return trees_[link->tree].mover;
  const FreeBody* free = bodies_.free(body);
  return free ? free->mover : -1;
}

void StepEquations::add_free(FreeBody& body, double duration) {
  body.turning.setZero();
  if (body.kinematic) return;
  const int count = static_cast<int>(body.axes.size());
  body.mover = solver_.add_mover(count);
  const btMatrix3x3 inertia = bodies_.inertia(body);
  double* const numbers = solver_.inertia(body.mover);
  double* const velocities = solver_.velocities(body.mover);
  for (int row = 0; row < count; ++row) {
    const int axis = body.axes[static_cast<std::size_t>(row)];
    velocities[row] = body.velocity[axis];
    if (axis < 3) {
      numbers[row * count + row] = 1.0 / body.inverse_mass;
      continue;
    }
    for (int column = 0; column < count; ++column) {
      const int other = body.axes[static_cast<std::size_t>(column)];
      if (other >= 3) numbers[row * count + column] = inertia[axis - 3][other - 3];
    }
  }
  kick(body, duration, solver_.free(body.mover));
  if (scene_.bodies()[body.body].damped()) damp(body, duration);
  if (body.unlocked == 6) find_turning(body, duration);
}

// The damping is that at the end of the substep: what it resists counts as inertia, as of drives.
void StepEquations::damp(const FreeBody& body, double duration) {
  const auto count = static_cast<Eigen::Index>(body.axes.size());
  Eigen::Map<Eigen::MatrixXd> inertia(solver_.inertia(body.mover), count, count);
  Eigen::Map<Eigen::VectorXd> free(solver_.free(body.mover), count);
  Eigen::VectorXd resistance(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    resistance[i] = duration * scene_.bodies()[body.body].damping(body.axes[static_cast<std::size_t>(i)]);
  }
  inertia.diagonal() += resistance;
  free -= inertia.ldlt().solve(resistance.cwiseProduct(free));
}

// Velocities after the loads of the substep.
void StepEquations::kick(const FreeBody& body, double duration, double* free) const {
  const btVector3 acceleration = body.acceleration + body.held + body.force * body.inverse_mass;
  const btVector3 twist = body.torque * duration;
  int turns[3] = {0, 0, 0};
  int count = 0;
  for (const int axis : body.axes) {
    if (axis >= 3) turns[count++] = axis - 3;
  }
  Velocity change{acceleration * duration, btVector3(0, 0, 0)};
  if (!twist.isZero() && count == 3) {
    const btMatrix3x3& axes = bodies_.poses()[body.body].getBasis();
    change.angular = axes * (twist * axes / body.moments);
  } else if (!twist.isZero()) {
    const btMatrix3x3 inertia = bodies_.inertia(body);
    const int x = turns[0], y = turns[1];
    if (count == 1) {
      change.angular[x] = twist[x] / inertia[x][x];
    } else if (count == 2) {
      const double determinant = inertia[x][x] * inertia[y][y] - inertia[x][y] * inertia[y][x];
      change.angular[x] = (inertia[y][y] * twist[x] - inertia[x][y] * twist[y]) / determinant;
      change.angular[y] = (inertia[x][x] * twist[y] - inertia[y][x] * twist[x]) / determinant;
    }
  }
  for (std::size_t row = 0; row < body.axes.size(); ++row) {
    free[row] = body.velocity[body.axes[row]] + change[body.axes[row]];
  }
}

// Zero where the spin stays what it is, or nearly so.
void StepEquations::find_turning(FreeBody& body, double duration) const {
  const btMatrix3x3& axes = bodies_.poses()[body.body].getBasis();
  const btVector3 local = body.velocity.angular * axes;
  const btVector3 turning = local.cross(body.moments * local) / body.moments;
  if (turning.length2() * duration * duration <= steady_spin * steady_spin * local.length2()) return;
  body.turning = axes * turning;
}

// A body that turns freely keeps its angular momentum, and by the midpoint rule its energy (Simo and Wong 1991).
void StepEquations::coast(FreeBody& body, double duration) const {
  const btMatrix3x3& axes = bodies_.poses()[body.body].getBasis();
  const btVector3 momentum = bodies_.inertia(body) * body.pushed.angular;
  const auto spin_after = [&](const btVector3& turn) {
    const btVector3 turned_back = rotated(momentum, -turn) * axes / body.moments;
    return rotated(axes * turned_back, turn);
  };
  btVector3& mean = body.way.angular;
  for (int iteration = 0; iteration < midpoint_iterations; ++iteration) {
    const btVector3 before = mean;
    mean = spin_after(mean * (0.5 * duration));
    if ((mean - before).length2() <= steady_spin * steady_spin * mean.length2()) break;
  }
  body.spin = spin_after(mean * duration);
}

// Whether a tree is free, and so are all whose joints follow its own or lead them.
bool StepEquations::is_alone(std::size_t index, const Substep& substep) const {
  const auto alone = [&](const JointSum::Term& term) { return is_free(term.link.tree, substep); };
  for (const std::vector<MimicConstraint>& group : bodies_.mimics()) {
    if (std::none_of(group.begin(), group.end(), [&](const MimicConstraint& of) { return of.has(index); })) continue;
    for (const MimicConstraint& mimic : group) {
      if (!std::all_of(mimic.terms.begin(), mimic.terms.end(), alone)) return false;
    }
  }
  return is_free(index, substep);
}

// Whether nothing touches a tree in this substep, and nothing drives or holds it.
bool StepEquations::is_free(std::size_t index, const Substep& substep) const {
  Articulation& tree = this->tree(index);
  if (tree.drives() || tree.kinematic() || tree.looped()) return false;
  const auto is_here = [&](std::size_t body) { return bodies_.link(body) && bodies_.link(body)->tree == index; };
  for (const Articulation::Link& link : tree.links()) {
    if (!link.force.isZero() || !link.torque.isZero()) return false;
  }
  for (const ContactPoint& point : substep.contacts) {
    if (is_here(point.a) || is_here(point.b)) return false;
  }
  for (const Motor& motor : substep.motors) {
    if (is_here(motor.body)) return false;
  }
  for (const TendonControl& tendon : bodies_.tendons()) {
    if (tendon.has(index)) return false;
  }
  return std::all_of(tree.controls().begin(), tree.controls().end(), [&](const JointControl& control) {
    const double position = tree.link(control.link).position;
    const double speed = tree.velocities()[static_cast<std::size_t>(control.velocity)];
    const double reach = stop_reach(substep.duration, std::abs(speed));
    const Joint& joint = *control.joint;
    return joint.friction == 0.0 && position - joint.lower > reach && joint.upper - position > reach;
  });
}

// A joint that hits its stop speeds up its neighbours within the same step.
void StepEquations::add_tree(std::size_t i, const Substep& substep) {
  Articulation& tree = this->tree(i);
  tree.prepare(substep.duration, to_bullet(scene_.gravity()), is_alone(i, substep));
  const std::size_t skipped = tree.prescribed();
  const std::size_t count = tree.count() - skipped;
  trees_[i].mover = -1;
  if (count == 0) return;
  const int mover = trees_[i].mover = solver_.add_mover(static_cast<int>(count));
  for (std::size_t row = 0; row < count; ++row) {
    std::copy_n(tree.inertia_row(skipped + row) + skipped, count, solver_.inertia(mover) + row * count);
    solver_.free(mover)[row] = tree.kicked()[skipped + row];
    solver_.velocities(mover)[row] = tree.velocities()[skipped + row];
  }
  double fastest = 0.0;
  for (const JointControl& control : tree.controls()) {
    const auto velocity = static_cast<std::size_t>(control.velocity);
    fastest = std::max({fastest, std::abs(tree.kicked()[velocity]), std::abs(tree.velocities()[velocity])});
  }
  const double reach = stop_reach(substep.duration, fastest);
  for (const JointControl& control : tree.controls()) {
    const double position = tree.link(control.link).position;
    const double lower = position - control.joint->lower;
    const double upper = control.joint->upper - position;
    if (control.law->drives() && tree.drives_by_row(control)) {
      set_drive(add_joint_row(i, control, 1.0), control, position, substep.duration);
    }
    if (control.joint->friction > 0.0) {
      set_dry_friction(add_joint_row(i, control, 1.0), control.joint->friction, substep.duration);
    }
    if (lower < reach) set_stop(add_joint_row(i, control, 1.0), lower, substep.duration);
    if (upper < reach) set_stop(add_joint_row(i, control, -1.0), upper, substep.duration);
  }
}

void StepEquations::set_free(FreeBody& body, double duration) const {
  body.pushed = body.velocity;
  for (std::size_t row = 0; row < body.unlocked; ++row) {
    body.pushed[body.axes[row]] = solver_.velocities(body.mover)[row];
  }
  body.way = body.pushed;
  body.spin = body.pushed.angular;
  if (!body.turning.isZero()) coast(body, duration);
}

void StepEquations::set_tree(std::size_t i, double duration) {
  Articulation& tree = this->tree(i);
  auto& [mover, pushed, end] = trees_[i];
  const std::size_t skipped = tree.prescribed();
  pushed = tree.kicked();
  if (mover >= 0) std::copy_n(solver_.velocities(mover), solver_.count(mover), pushed.data() + skipped);
  end = pushed;
  tree.coast(duration, end);
}

// Work is done before all coasts. `share` is that of their way that bodies can go.
void StepEquations::commit(const Substep& substep, double share) {
  write_contacts(substep.contacts);
  for (FreeBody& body : bodies_.free()) body.velocity = body.pushed;
  for (std::size_t i = 0; i < trees_.size(); ++i) tree(i).velocities() = trees_[i].pushed;
  if (audit.before) {
    add_work(substep, share);
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      audit.work.integration += tree(i).gravity_beside(substep.duration, audit.before->trees[i], trees_[i].end);
    }
  }
  if (share < 1.0) return;  // what does not get to where it coasts gains no energy of it
  for (FreeBody& body : bodies_.free()) body.velocity.angular = body.spin;
  for (std::size_t i = 0; i < trees_.size(); ++i) tree(i).velocities() = trees_[i].end;
}

}  // namespace energymargin

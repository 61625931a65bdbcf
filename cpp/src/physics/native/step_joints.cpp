// Stops, drives and dry friction of joints and tendons, and loops, as rows over the velocities.

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/portable.hpp"
#include "physics/native/step_equations.hpp"

namespace energymargin {
namespace {

// Up to this speed errors are put right by the velocities, which no one can tell from rest; beyond, beside them [m/s].
constexpr double slow = 1e-3;

// Along an axis along which impulses move a loop's bodies by less than this share of what they do along another one,
// errors are mostly left alone.
constexpr double singular_share = 0.01;

// Below this share of what an impulse does to a body alone it does nothing: what is left are rounding errors.
constexpr double still_share = 1e-9;

// A loop that is off by less at the end of a substep is closed [m] or [rad].
constexpr double least_miss = 1e-9;

// The turn from b to a, as a vector in the world [rad].
btVector3 turn_between(const btMatrix3x3& a, const btMatrix3x3& b) {
  btQuaternion turn;
  a.timesTranspose(b).getRotation(turn);
  return to_bullet(portable::rotation_vector(from_bullet(turn)));
}

}  // namespace

LimitedRow& StepEquations::add_joint_row(std::size_t tree, const JointControl& control, double direction) {
  LimitedRow& row = solver_.add_limited(trees_[tree].mover, -1);
  solver_.numbers(row.of_a)[static_cast<std::size_t>(control.velocity) - this->tree(tree).prescribed()] = direction;
  return row;
}

// impulse = pull - resistance * speed, within the limit.
void StepEquations::set_drive(LimitedRow& row, const Control& control, double position, double duration) {
  row.softness = 1.0 / control.resistance(duration);
  row.target = control.pull(duration, position) * row.softness;
  row.high = duration * control.law->torque_limit;
  row.low = -row.high;
  follow_way(row, duration);
}

void StepEquations::set_dry_friction(LimitedRow& row, double most, double duration) {
  row.work = &audit.work.joints;
  row.softness = softness_share * solver_.inverse_mass(row, 0);
  row.high = duration * most;
  row.low = -row.high;
  follow_way(row, duration);
}

// Nothing crosses its stop in this step; what is beyond it is brought back.
void StepEquations::set_stop(LimitedRow& row, double gap, double duration) {
  row.work = &audit.work.joints;
  row.low = 0.0;
  row.softness = softness_share * solver_.inverse_mass(row, 0);
  row.target = -gap / duration;
  if (gap <= 0.0) share_error(-gap, row.target, row.recovery);
  follow_way(row, duration);
}

// The target of the last row is one of the way, which bends as trees coast.
void StepEquations::follow_way(LimitedRow& row, double duration) {
  const double bend = 0.5 * duration * along(row, [](const Articulation& tree, const TreeMover&, std::size_t k) {
                        return tree.coasting()[k];
                      });
  row.target -= bend;
  bent_rows_.push_back({solver_.limited().size() - 1, bend});
}

// The sum along a row of what its trees have at each velocity.
template <typename Value>
double StepEquations::along(const LimitedRow& row, const Value& value) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    const int mover = trees_[i].mover;
    if (mover < 0 || (mover != row.a && mover != row.b)) continue;
    const double* const numbers = solver_.numbers(mover == row.a ? row.of_a : row.of_b);
    const std::size_t skipped = tree(i).prescribed();
    for (std::size_t k = skipped; k < tree(i).count(); ++k) {
      if (numbers[k - skipped] != 0.0) sum += numbers[k - skipped] * value(tree(i), trees_[i], k);
    }
  }
  return sum;
}

// Where a row holds, its target makes up for how the way bent in truth. Whether it counts anywhere.
bool StepEquations::straighten_ways(double duration) {
  bool counts = false;
  for (auto& [index, bend] : bent_rows_) {
    LimitedRow& row = solver_.limited()[index];
    const bool stops = row.low == 0.0;  // the way may lead beyond, though the velocities did not
    if (!stops && !(row.low < row.impulse && row.impulse < row.high)) continue;
    const double before = bend;
    bend = along(row, [](const Articulation& tree, const TreeMover& of, std::size_t k) {
      return tree.ways()[k] - of.pushed[k];
    });
    row.target -= bend - before;
    row.miss -= bend - before;
    const bool holds = row.impulse > 0.0 || row.miss > 0.0 || !stops;
    counts = counts || (holds && std::abs(bend - before) * duration > least_miss);
  }
  return counts;
}

// Speed that puts a share of an error right, and how much of that is to be done beside the velocities.
void StepEquations::share_error(double error, double& target, double& recovery) const {
  const double speed = error_share * error / scene_.stepping().step;
  target = std::clamp(speed, -slow, slow);
  recovery = speed - target;
}

JointState StepEquations::sum_of(const JointSum& sum) const {
  JointState at;
  for (const auto& [on, coefficient] : sum.terms) {
    const Articulation& tree = this->tree(on.tree);
    const Articulation::Link& link = tree.link(on.link);
    at.position += coefficient * link.position;
    if (link.velocity >= 0) at.velocity += coefficient * tree.velocities()[static_cast<std::size_t>(link.velocity)];
  }
  return at;
}

LimitedRow& StepEquations::add_sum_row(const JointSum& sum, double direction) {
  const std::size_t first = sum.terms.front().link.tree;
  std::size_t other = first;
  for (const JointSum::Term& term : sum.terms) {
    if (term.link.tree != first) other = term.link.tree;
  }
  LimitedRow& row = solver_.add_limited(trees_[first].mover, trees_[other].mover);
  for_each_velocity(sum, [&](std::size_t tree, std::size_t k, double coefficient) {
    double* const numbers = solver_.numbers(trees_[tree].mover == row.a ? row.of_a : row.of_b);
    numbers[k - this->tree(tree).prescribed()] += direction * coefficient;
  });
  return row;
}

void StepEquations::add_tendon(const TendonControl& control, double duration) {
  bool moves = false;
  for_each_velocity(control, [&](std::size_t, std::size_t, double) { moves = true; });
  if (!moves) return;
  const Tendon& tendon = *control.tendon;
  const JointState at = sum_of(control);
  const double reach = stop_reach(duration, std::abs(at.velocity));
  if (tendon.drives()) set_drive(add_sum_row(control, 1.0), control, at.position, duration);
  if (tendon.friction > 0.0) set_dry_friction(add_sum_row(control, 1.0), tendon.friction, duration);
  if (at.position - tendon.lower < reach) set_stop(add_sum_row(control, 1.0), at.position - tendon.lower, duration);
  if (tendon.upper - at.position < reach) set_stop(add_sum_row(control, -1.0), tendon.upper - at.position, duration);
}

// How far the frame of body a is from that of b, along and about the axes of the world, where the bodies are.
StepEquations::LoopGap StepEquations::gap_of(const LoopConstraint& loop, const btTransform& of_a,
                                             const btTransform& of_b) {
  const btTransform a = of_a * loop.in_a, b = of_b * loop.in_b;
  return {a.getOrigin(), b.getOrigin(), {turn_between(a.getBasis(), b.getBasis()), a.getOrigin() - b.getOrigin()}};
}

void StepEquations::add_loop(const LoopConstraint& loop, double duration) {
  if (mover_of(loop.a) < 0 && mover_of(loop.b) < 0) return;
  const LoopGap gap = gap_of(loop, bodies_.poses()[loop.a], bodies_.poses()[loop.b]);
  add_loop_rows(loop, gap, false, duration);
  if (loop.weld) add_loop_rows(loop, gap, true, duration);
}

// Three rows, along or about the axes along which impulses move the bodies most and least: where links line up, the
// loop is singular, and hardly anything moves along one of them. Errors along it are put right by less then, and along
// what does not move at all there is no row. Where no time passes, rows hold velocities alone.
void StepEquations::add_loop_rows(const LoopConstraint& loop, const LoopGap& gap, bool turns, double duration) {
  const std::size_t first = solver_.limited().size();
  const auto add = [&](const btVector3& axis) {
    LimitedRow& row = solver_.add_limited(mover_of(loop.a), mover_of(loop.b));
    const SpatialVector along =
        turns ? SpatialVector{axis, btVector3(0, 0, 0)} : SpatialVector{btVector3(0, 0, 0), axis};
    row.target = -add_loop_end(row, loop.a, gap.at_a, along) - add_loop_end(row, loop.b, gap.at_b, along * -1.0);
  };
  for (int axis = 0; axis < 3; ++axis) add(btMatrix3x3::getIdentity()[axis]);
  Eigen::Matrix3d delassus;
  for (int i = 0; i < 9; ++i) {
    const auto rows = solver_.limited().begin() + static_cast<std::ptrdiff_t>(first);
    delassus(i) = solver_.delassus(rows[i / 3], rows[i % 3]);
  }
  solver_.limited().resize(first);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(delassus);
  const double most = axes.eigenvalues()[2], alone = inverse_mass_alone(loop, turns);
  for (int i = 0; i < 3; ++i) {
    const double moves = axes.eigenvalues()[i];
    const double share = std::max(moves / most, moves / alone);
    if (!(moves > still_share * alone && share > least_inverse_mass)) continue;
    const btVector3 axis = to_bullet(Vector3(axes.eigenvectors().col(i)));
    add(axis);
    LimitedRow& row = solver_.limited().back();
    const double moved = -row.target;
    row.work = &audit.work.joints;
    row.softness = coupling_softness * most;
    const double weight = share / (share + singular_share);
    const double error = axis.dot(turns ? gap.gap.angular : gap.gap.linear);
    double speed = 0.0;
    if (duration > 0.0) {
      share_error(-weight * error, speed, row.recovery);
    } else {
      row.softness = singular_share * moves / share;
    }
    row.target += speed;
    loop_rows_.push_back({&loop, turns, axis, solver_.limited().size() - 1, error + speed * duration, weight, moved});
  }
}

// What a unit impulse does to the heavier one of the bodies that forces move, alone.
double StepEquations::inverse_mass_alone(const LoopConstraint& loop, bool turns) const {
  double most = 0.0;
  for (const std::size_t index : {loop.a, loop.b}) {
    const Body& body = scene_.bodies()[index];
    if (body.dynamic()) most = std::max(most, turns ? scene_.inertial(index).moments.maxCoeff() : body.mass);
  }
  return 1.0 / most;
}

// Adds what an impulse along the axis does to the body that has it. The end's speed, where that is prescribed.
double StepEquations::add_loop_end(LimitedRow& row, std::size_t index, const btVector3& point,
                                   const SpatialVector& along) {
  double prescribed = 0.0;
  if (const auto& on = bodies_.link(index)) {
    const Articulation& tree = this->tree(on->tree);
    std::vector<double> whole(tree.count(), 0.0);
    const btVector3 arm = point - tree.origin();
    tree.add(on->link, {along.angular + arm.cross(along.linear), along.linear}, whole.data());
    double* const numbers = solver_.numbers(trees_[on->tree].mover == row.a ? row.of_a : row.of_b);
    const std::size_t skipped = tree.prescribed();
    for (std::size_t k = 0; k < skipped; ++k) prescribed += whole[k] * tree.kicked()[k];
    for (std::size_t k = skipped; k < tree.count(); ++k) numbers[k - skipped] += whole[k];
  } else if (const FreeBody* body = bodies_.free(index)) {
    const btVector3 about = along.angular + (point - bodies_.poses()[index].getOrigin()).cross(along.linear);
    if (body->mover < 0) return along.linear.dot(body->velocity.linear) + about.dot(body->velocity.angular);
    double* const numbers = solver_.numbers(body->mover == row.a ? row.of_a : row.of_b);
    for (std::size_t k = 0; k < body->axes.size(); ++k) {
      numbers[k] += body->axes[k] < 3 ? along.linear[body->axes[k]] : about[body->axes[k] - 3];
    }
  }
  return prescribed;
}

// Ways bend, and velocities that close a loop where it is open it where they lead: they are asked to make up for that,
// as in SHAKE (Ryckaert, Ciccotti and Berendsen 1977). Whether it counts anywhere.
bool StepEquations::close_loops(double duration) {
  if (loop_rows_.empty()) return false;
  for (const auto& tree : bodies_.trees()) {
    if (tree->looped()) tree->look_ahead(duration);
  }
  const auto pose = [&](std::size_t body) {
    if (const auto& on = bodies_.link(body)) return tree(on->tree).link(on->link).pose;
    const FreeBody* free = bodies_.free(body);
    const btTransform& at = bodies_.poses()[body];
    return free ? moved_pose(at, free->way.linear * duration, free->way.angular * duration) : at;
  };
  bool counts = false;
  for (const auto& [loop, turns, axis, row, wanted, weight, moved] : loop_rows_) {
    const SpatialVector gap = gap_of(*loop, pose(loop->a), pose(loop->b)).gap;
    const double miss = weight * (axis.dot(turns ? gap.angular : gap.linear) - wanted);
    solver_.limited()[row].target -= miss / duration;
    counts = counts || std::abs(miss) > least_miss;
  }
  for (const auto& tree : bodies_.trees()) {
    if (tree->looped()) tree->put_back();
  }
  return counts;
}

// How fast a body in a loop turns, or the fastest link of its tree [rad/s].
double StepEquations::fastest_in_loops() const {
  double fastest = 0.0;
  for (const LoopConstraint& loop : bodies_.loops()) {
    for (const std::size_t body : {loop.a, loop.b}) {
      if (const auto& on = bodies_.link(body)) {
        fastest = std::max(fastest, tree(on->tree).fastest_turn(tree(on->tree).velocities()));
      } else if (const FreeBody* free = bodies_.free(body)) {
        fastest = std::max(fastest, free->velocity.angular.length());
      }
    }
  }
  return fastest;
}

double StepEquations::until_turned(double duration, double least) const {
  const double pieces = std::min(std::ceil(fastest_in_loops() * duration / loop_turn), std::floor(duration / least));
  return pieces > 1.0 ? duration / pieces : duration;
}

}  // namespace energymargin

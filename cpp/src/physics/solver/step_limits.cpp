// Stops, limited drives, mimics and motors as rows over the velocities.

#include <algorithm>
#include <limits>

#include "physics/solver/step_equations.hpp"

namespace energymargin {
namespace {

// Motors and stops are soft in the same sense.
constexpr double softness_share = 1e-5;

// Mimics hold more tightly.
constexpr double mimic_softness = 1e-7;

// This share of a penetration, or of another error of the positions, is put right in a whole step; Bullet's own value.
constexpr double error_share = 0.2;

// Up to this speed errors are put right by the velocities, which no one can tell from rest; beyond, beside them [m/s].
constexpr double slow = 1e-3;

constexpr double no_limit = std::numeric_limits<double>::infinity();

}  // namespace

LimitedRow& StepEquations::add_limited(Kind kind, int a, int b) {
  kinds_.push_back(kind);
  LimitedRow& row = solver_.add_limited(a, b);
  row.low = -no_limit;
  row.high = no_limit;
  return row;
}

// impulse = pull - resistance * speed, within the limit.
void StepEquations::add_drive(std::size_t tree, const JointControl& control, double position, double duration) {
  LimitedRow& row = add_limited(Kind::drive, trees_[tree].mover, -1);
  solver_.numbers(row.of_a)[static_cast<std::size_t>(control.velocity) - this->tree(tree).prescribed()] = 1.0;
  row.softness = 1.0 / control.resistance(duration);
  row.target = control.pull(duration, position) * row.softness;
  row.high = duration * control.joint->torque_limit;
  row.low = -row.high;
}

// Speed that puts a share of an error right, and how much of that is to be done beside the velocities.
void StepEquations::share_error(double error, double& target, double& recovery) const {
  const double speed = error_share * error / scene_.stepping().step;
  target = std::clamp(speed, -slow, slow);
  recovery = speed - target;
}

// The joint may not cross its stop in this step; beyond it, it is brought back.
void StepEquations::add_stop(std::size_t tree, const JointControl& control, double direction, double gap,
                             double duration) {
  LimitedRow& row = add_limited(Kind::stop, trees_[tree].mover, -1);
  solver_.numbers(row.of_a)[static_cast<std::size_t>(control.velocity) - this->tree(tree).prescribed()] = direction;
  row.low = 0.0;
  row.softness = softness_share * solver_.inverse_mass(row, 0);
  row.target = -gap / duration;
  if (gap <= 0.0) share_error(-gap, row.target, row.recovery);
}

void StepEquations::add_mimic(const MimicConstraint& mimic) {
  const Articulation &tree_a = tree(mimic.follower.tree), &tree_b = tree(mimic.followed.tree);
  const Articulation::Link& follower = tree_a.link(mimic.follower.link);
  const Articulation::Link& followed = tree_b.link(mimic.followed.link);
  const double multiplier = mimic.mimic.multiplier;
  LimitedRow& row = add_limited(Kind::mimic, trees_[mimic.follower.tree].mover, trees_[mimic.followed.tree].mover);
  const auto column = [](const Articulation& tree, const Articulation::Link& link) {
    return static_cast<std::size_t>(link.velocity) - tree.prescribed();
  };
  solver_.numbers(row.of_a)[column(tree_a, follower)] += 1.0;
  solver_.numbers(row.b < 0 ? row.of_a : row.of_b)[column(tree_b, followed)] -= multiplier;
  const double error = follower.position - multiplier * followed.position - mimic.mimic.offset;
  row.softness = mimic_softness * solver_.inverse_mass(row, 0);
  share_error(-error, row.target, row.recovery);
}

// A row along and about each axis that is not locked.
void StepEquations::add_motor(const Motor& motor, double duration) {
  const int mover = mover_of(motor.body);
  const auto& link = bodies_.link(motor.body);
  if (mover < 0 || (link && tree(link->tree).prescribed() > 0)) return;
  const int count = link ? velocities_of_free_body : solver_.count(mover);
  for (int column = 0; column < count; ++column) {
    const int axis = link ? column : bodies_.free(motor.body)->axes[static_cast<std::size_t>(column)];
    LimitedRow& row = add_limited(Kind::motor, mover, -1);
    solver_.numbers(row.of_a)[column] = 1.0;
    row.softness = softness_share * solver_.inverse_mass(row, 0);
    row.target = axis < 3 ? motor.linear[axis] : motor.angular[axis - 3];
    row.high = (axis < 3 ? motor.force : motor.torque) * duration;
    row.low = -row.high;
  }
}

}  // namespace energymargin

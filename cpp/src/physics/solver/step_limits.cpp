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
  const TreeDynamics& dynamics = trees_[tree];
  LimitedRow& row = add_limited(Kind::drive, tree_movers_[tree], -1);
  solver_.numbers(row.of_a)[static_cast<std::size_t>(control.velocity) - dynamics.prescribed()] = 1.0;
  row.softness = 1.0 / control.resistance(duration);
  row.target = control.pull(duration, position) * row.softness;
  row.high = control.impulse_limit(duration);
  row.low = -row.high;
}

// Speed that puts a share of an error right, and how much of that is to be done beside the velocities.
void StepEquations::share_error(double error, const Substep& substep, double& target, double& recovery) const {
  const double speed = error_share * error / substep.whole;
  target = std::clamp(speed, -slow, slow);
  recovery = speed - target;
}

// The joint may not cross its stop in this step; beyond it, it is brought back.
void StepEquations::add_stop(std::size_t tree, const JointControl& control, double direction, double gap,
                             const Substep& substep) {
  const TreeDynamics& dynamics = trees_[tree];
  const auto velocity = static_cast<std::size_t>(control.velocity);
  LimitedRow& row = add_limited(Kind::stop, tree_movers_[tree], -1);
  solver_.numbers(row.of_a)[velocity - dynamics.prescribed()] = direction;
  row.low = 0.0;
  row.softness = softness_share * solver_.inverse_mass(row, 0);
  row.target = -gap / substep.duration;
  if (gap <= 0.0) share_error(-gap, substep, row.target, row.recovery);
}

void StepEquations::add_mimic(const MimicConstraint& mimic, const Substep& substep) {
  const auto link = [this](const MimicConstraint::End& end) -> const Articulation::Link& {
    return trees_[end.tree].tree().links()[static_cast<std::size_t>(end.link)];
  };
  const Articulation::Link& follower = link(mimic.follower);
  const Articulation::Link& followed = link(mimic.followed);
  const double multiplier = mimic.mimic.multiplier;
  const std::size_t tree_a = mimic.follower.tree, tree_b = mimic.followed.tree;
  LimitedRow& row = add_limited(Kind::mimic, tree_movers_[tree_a], tree_movers_[tree_b]);
  const auto column = [&](std::size_t tree, const Articulation::Link& of) {
    return static_cast<std::size_t>(of.velocity) - trees_[tree].prescribed();
  };
  solver_.numbers(row.of_a)[column(tree_a, follower)] += 1.0;
  solver_.numbers(row.b < 0 ? row.of_a : row.of_b)[column(tree_b, followed)] -= multiplier;
  const double error = follower.position - multiplier * followed.position - mimic.mimic.offset;
  row.softness = mimic_softness * solver_.inverse_mass(row, 0);
  share_error(-error, substep, row.target, row.recovery);
}

// A row along and about each axis that is not locked.
void StepEquations::add_motor(const Motor& motor, double duration) {
  const int mover = mover_of(motor.body);
  const auto& tree = bodies_.tree_of(motor.body);
  if (mover < 0 || (tree && trees_[*tree].prescribed() > 0)) return;
  const int count = tree ? velocities_of_free_body : solver_.count(mover);
  for (int column = 0; column < count; ++column) {
    const int axis = tree ? column : rigid(motor.body).axes[static_cast<std::size_t>(column)];
    LimitedRow& row = add_limited(Kind::motor, mover, -1);
    solver_.numbers(row.of_a)[column] = 1.0;
    row.softness = softness_share * solver_.inverse_mass(row, 0);
    row.target = axis < 3 ? motor.linear[axis] : motor.angular[axis - 3];
    row.high = (axis < 3 ? motor.force : motor.torque) * duration;
    row.low = -row.high;
  }
}

}  // namespace energymargin

// Where neither Newton's method nor friction with fixed bounds ends: many contacts between which bodies are wedged. All
// of them together change what they do in each iteration, since they are hard. Of softer ones few do, so Newton's
// method ends. Targets that make up for how far the last impulses would give way lead on to the hard ones: the proximal
// point method (Rockafellar 1976).

#include <algorithm>
#include <cmath>

#include "base/portable.hpp"
#include "physics/native/newton_solver.hpp"

namespace energymargin {
namespace {

// The softness from which Newton's method mostly ends, as a share of what a unit impulse changes along a row.
constexpr double soft_share = 0.1;

// Levels: 1 is that softness, 0 the rows' own, and between them it goes as a power. Rows become harder by so much at
// first, and at least; where Newton's method does not end they become softer again.
constexpr double softest_level = 1.0, first_descent = 0.25, least_descent = 0.05, shorter = 0.7;
constexpr double ascent = 0.4, highest_level = 1.5;

// Iterations at a level, and at the first one. The error that is enough for the next level.
constexpr int most_at_level = 6, most_at_first = 20;
constexpr double rough = 1e-2;

double softer(double own, double soft, double level) {
  return soft > own && level > 0.0 ? portable::pow(soft / own, level) : 1.0;
}

}  // namespace

// Makes the rows of an island, which are `hard` at level 0, as soft as the level. Their impulses solve the equations at
// all levels if they do at one.
void NewtonSolver::soften(const Island& island, const HardRows& hard, double level) {
  for (const std::size_t k : island.contacts) {
    const ContactRows& own = hard.contacts[k];
    ContactRows& rows = contacts_[k];
    const double factor = softer(own.law.normal_softness, soft_share * inverse_mass(own, normal_row), level);
    rows.law.normal_softness = factor * own.law.normal_softness;
    rows.law.tangential_softness = factor * own.law.tangential_softness;
    for (int row = 0; row < own.law.rows; ++row) {
      const auto i = static_cast<std::size_t>(row);
      const double softness = row == normal_row ? own.law.normal_softness : own.law.tangential_softness;
      rows.target[i] = own.target[i] + (factor - 1.0) * softness * rows.impulse[i];
    }
  }
  for (const std::size_t k : island.limited) {
    const LimitedRow& own = hard.limited[k];
    if (std::isinf(own.low) && std::isinf(own.high)) continue;  // linear
    const double factor = softer(own.softness, soft_share * inverse_mass(own, 0), level);
    limited_[k].softness = factor * own.softness;
    limited_[k].target = own.target + (factor - 1.0) * own.softness * limited_[k].impulse;
  }
}

// Newton's method on (1), for at most so many iterations. The error.
double NewtonSolver::descend(const Island& island, int most, double tolerance) {
  double error = coulomb_error(island, false);
  for (; error > tolerance && most > 0 && soft_left_ > 0 && find_direction(island);
       --most, --soft_left_, ++iterations_) {
    keep_directions(island);
    add_step(island, 1.0);
    error = coulomb_error(island, true);
    if (error <= tolerance && stopped_) error = coulomb_error(island, false);
  }
  return error;
}

void NewtonSolver::keep_impulses(const Island& island) {
  for (const std::size_t k : island.contacts) contacts_[k].impulse = contacts_[k].response.impulse;
  for (const std::size_t k : island.limited) limited_[k].impulse = limited_[k].impulse_of_miss();
}

// From the velocities, with the impulses of the last evaluation, or else from the start of the step without any.
// Whether one of them leads to Coulomb's law; if not, velocities are as before.
bool NewtonSolver::find_gradually(const Island& island, double level, double tolerance) {
  const int most = soft_left_;
  const std::vector<double> before = velocities_;
  keep_impulses(island);
  if (harden_gradually(island, level, tolerance)) return true;
  copy(island, start_, velocities_);
  for (const std::size_t k : island.contacts) contacts_[k].impulse = {};
  for (const std::size_t k : island.limited) limited_[k].impulse = 0.0;
  soft_left_ = most;
  if (harden_gradually(island, softest_level, tolerance)) return true;
  copy(island, before, velocities_);
  return false;
}

// From the velocities and the impulses of the rows, at a level at first, to level 0. Whether it got there; if not,
// velocities are as before.
bool NewtonSolver::harden_gradually(const Island& island, double level, double tolerance) {
  const HardRows hard{contacts_, limited_};
  const std::vector<double> before = velocities_;
  std::vector<double> last = before;
  double descent = first_descent;
  int most = most_at_first;
  while (soft_left_ > 0) {
    soften(island, hard, level);
    copy(island, last, velocities_);
    const double aim = level > 0.0 ? std::max(rough, tolerance) : tolerance;
    if (descend(island, most, aim) <= aim) {
      if (level == 0.0) return true;
      keep_impulses(island);
      copy(island, velocities_, last);
      level = level < descent + least_descent ? 0.0 : level - descent;
    } else {
      level = std::min(highest_level, level + ascent);
      descent = std::max(least_descent, shorter * descent);
      --soft_left_;  // also where no direction is found
    }
    most = most_at_level;
  }
  soften(island, hard, 0.0);
  copy(island, before, velocities_);
  return false;
}

}  // namespace energymargin

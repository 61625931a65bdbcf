// Blows of what bounces: bodies that touch and meet part at once, in no time, one pair after another as they meet.

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "physics/solver/step_equations.hpp"

namespace energymargin {
namespace {

// Bodies touch that would do so within this share of a step.
constexpr double touch = 1e-3;

// What bounces gives way by less than what rests, as a share of that.
constexpr double bouncing_softness = 1e-2;

// A blow that gives an island energy, by more than this share of what its impulses exchange, parts its bodies by so
// much less, again and again: 0.85^16 is 0.07.
constexpr double least_gain = 1e-6, weaker = 0.85;
constexpr int most_weaker = 16;

}  // namespace

double StepEquations::closing_speed(const ContactPoint& point) const {
  return point.normal.dot(bodies_.velocity(point.b, point.on_b) - bodies_.velocity(point.a, point.on_a));
}

bool StepEquations::touches(const ContactPoint& point) const {
  return point.distance <= touch * scene_.stepping().step * std::max(closing_speed(point), restitution_speed);
}

// Pairs that bounce take part where they meet: others of them that touch, and are at rest, are hit in the next blow.
// What does not bounce bears what it touches, unless it gives way: that takes time.
bool StepEquations::find_blow(const std::vector<ContactPoint>& contacts) {
  if (!surfaces_) return false;
  std::set<std::pair<std::size_t, std::size_t>> meeting;
  in_blow_.assign(contacts.size(), false);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint& point = contacts[i];
    if (mover_of(point.a) < 0 && mover_of(point.b) < 0) continue;
    in_blow_[i] = touches(point);
    if (!in_blow_[i] || !(scene_.contact_surface(point.a, point.b).restitution > 0.0)) continue;
    if (closing_speed(point) > restitution_speed) meeting.emplace(point.a, point.b);
  }
  if (meeting.empty()) return false;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint& point = contacts[i];
    if (!in_blow_[i] || meeting.count({point.a, point.b}) != 0) continue;
    const Surface surface = scene_.contact_surface(point.a, point.b);
    in_blow_[i] = !(surface.restitution > 0.0 || surface.stiffness > 0.0);
  }
  return true;
}

// Velocities are those of the middle of the step before: they lack half a step of what the loads do. A drive follows
// its target within a step, and so lacks nothing.
void StepEquations::find_lags(double duration) {
  lags_.assign(solver_.all_free().size(), 0.0);
  const double half = 0.5 * scene_.stepping().step / duration;
  const auto find = [&](int mover) {
    if (mover < 0) return;
    const double *const free = solver_.free(mover), *const now = solver_.velocities(mover);
    double* const lag = lags_.data() + solver_.begin(mover);
    for (int i = 0; i < solver_.count(mover); ++i) lag[i] = half * (free[i] - now[i]);
  };
  for (const FreeBody& body : bodies_.free()) find(body.mover);
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (!tree(i).drives()) find(trees_[i].mover);
  }
}

// Bodies that meet part with a share of their speed.
void StepEquations::set_rebound(ContactRows& rows, const Surface& surface) const {
  const double speed = rows.still - solver_.speed(rows, normal_row, solver_.all_velocities());
  if (!(surface.restitution > 0.0 && speed > restitution_speed)) return;
  const double lag = -solver_.speed(rows, normal_row, lags_);
  rows.rebound = std::max(0.0, surface.restitution * (speed + lag) + lag);
  rows.target[normal_row] += rows.rebound;
  rows.law.normal_softness *= bouncing_softness;
}

// Solves again while blows were too strong. Whether the last solution converged.
bool StepEquations::weaken_bounces(bool converged) {
  const Stepping& stepping = scene_.stepping();
  for (int i = 0; i < most_weaker && weaken_gains(); ++i) {
    converged = solver_.solve(stepping.iterations, stepping.tolerance, true);
  }
  return converged;
}

// Newton's law of impact may give energy where bodies slip (Kane 1984), or where several meet. Whether a blow did.
bool StepEquations::weaken_gains() {
  bool changed = false;
  for (std::size_t i = 0; i < solver_.islands().count(); ++i) {
    const Island& island = solver_.islands()[i];
    if (!gains(island)) continue;
    for (const std::size_t k : island.contacts) {
      ContactRows& rows = solver_.contacts()[k];
      rows.target[normal_row] -= (1.0 - weaker) * rows.rebound;
      changed = changed || rows.rebound > 0.0;
      rows.rebound *= weaker;
    }
  }
  return changed;
}

bool StepEquations::gains(const Island& island) const {
  double gain = 0.0, exchanged = 0.0;
  for (const std::size_t k : island.contacts) {
    const ContactRows& rows = solver_.contacts()[k];
    for (int i = 0; i < rows.law.rows; ++i) {
      const double moved = i == normal_row ? rows.still : rows.target[static_cast<std::size_t>(i)];
      const double lag = solver_.speed(rows, i, lags_) - moved;
      const double before = solver_.speed(rows, i, solver_.all_free()) + lag;
      const double after = solver_.speed(rows, i, solver_.all_velocities()) + lag;
      const double impulse = rows.impulse[static_cast<std::size_t>(i)];
      gain += 0.5 * impulse * (before + after);
      exchanged += 0.5 * std::abs(impulse * before);
    }
  }
  return gain > least_gain * exchanged;
}

}  // namespace energymargin

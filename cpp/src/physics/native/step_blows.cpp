// Blows of what bounces: bodies that touch and meet part at once, in no time, one pair after another as they meet.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "physics/native/step_equations.hpp"

namespace energymargin {
namespace {

// Bodies touch that would do so within this share of a step.
constexpr double touch = 1e-3;

// What bounces gives way by less than what rests, as a share of that.
constexpr double bouncing_softness = 1e-4;

// A blow that gives an island energy, by more than this share of what its impulses exchange, parts its bodies by so
// much less, again and again: 0.85^16 is 0.07.
constexpr double least_gain = 1e-6, weaker = 0.85;
constexpr int most_weaker = 16;

// Pairs meet at once whose speeds differ by less than this share.
constexpr double as_fast = 1e-6;

}  // namespace

double StepEquations::closing_speed(const ContactPoint& point) const {
  return point.normal.dot(bodies_.velocity(point.b, point.on_b) - bodies_.velocity(point.a, point.on_a));
}

bool StepEquations::touches(const ContactPoint& point) const {
  return point.distance <= touch * scene_.stepping().step * std::max(closing_speed(point), restitution_speed);
}

// What an impulse can move, by a number of its own: a tree is one. Unset of what is fixed or prescribed.
std::optional<std::size_t> StepEquations::movable(std::size_t body) const {
  if (const auto& link = bodies_.link(body)) return scene_.bodies().size() + link->tree;
  const FreeBody* free = bodies_.free(body);
  return free && !free->kinematic ? std::optional(body) : std::nullopt;
}

// One of those that touch each other, directly or by others.
std::size_t StepEquations::root_of(std::size_t number) {
  while (roots_[number] != number) number = roots_[number] = roots_[roots_[number]];
  return number;
}

void StepEquations::find_touching(const std::vector<ContactPoint>& contacts) {
  in_blow_.assign(contacts.size(), false);
  roots_.resize(scene_.bodies().size() + trees_.size());
  std::iota(roots_.begin(), roots_.end(), std::size_t{0});
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    in_blow_[i] = touches(contacts[i]);
    const auto a = movable(contacts[i].a), b = movable(contacts[i].b);
    if (in_blow_[i] && a && b) roots_[root_of(*a)] = root_of(*b);
  }
}

// Of pairs that meet, among bodies that touch each other, that which meets fastest takes part, and those that do so as
// fast: it changes how others meet, and they are hit in the next blow, as are those that touch at rest. What hits fixed
// bodies hits them as if they were one. What does not bounce bears what it touches, unless it gives way: that takes
// time.
bool StepEquations::find_blow(const std::vector<ContactPoint>& contacts) {
  if (!surfaces_) return false;
  const auto meets = [&](const ContactPoint& point) {
    return bounce(point.a, point.b) && closing_speed(point) > restitution_speed && touches(point);
  };
  if (std::none_of(contacts.begin(), contacts.end(), meets)) return false;
  find_touching(contacts);
  fastest_.assign(roots_.size(), 0.0);
  const auto cluster = [this](const ContactPoint& point) {
    const auto a = movable(point.a);
    return root_of(a ? *a : *movable(point.b));
  };
  for (const ContactPoint& point : contacts) {
    if (!meets(point)) continue;
    double& fastest = fastest_[cluster(point)];
    fastest = std::max(fastest, closing_speed(point));
  }
  std::set<std::pair<std::size_t, std::size_t>> first;
  std::vector<bool> on_fixed(roots_.size());  // whether the fastest hits something fixed
  const auto is_fastest = [&](const ContactPoint& point) {
    return closing_speed(point) >= (1.0 - as_fast) * fastest_[cluster(point)];
  };
  const auto hits_fixed = [this](const ContactPoint& point) { return !movable(point.a) || !movable(point.b); };
  for (const ContactPoint& point : contacts) {
    if (!meets(point) || !is_fastest(point)) continue;
    first.emplace(point.a, point.b);
    if (hits_fixed(point)) on_fixed[cluster(point)] = true;
  }
  for (const ContactPoint& point : contacts) {
    if (meets(point) && hits_fixed(point) && on_fixed[cluster(point)]) first.emplace(point.a, point.b);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint& point = contacts[i];
    if (!in_blow_[i]) continue;
    in_blow_[i] = bounce(point.a, point.b) ? first.count({point.a, point.b}) != 0
                                           : !(scene_.contact_surface(point.a, point.b).stiffness > 0.0);
  }
  return true;
}

bool StepEquations::bounce(std::size_t a, std::size_t b) const {
  return scene_.contact_surface(a, b).restitution > 0.0;
}

// What the loads of the substep would give the velocities of free bodies in another time [s].
void StepEquations::find_gains(double time, double duration, std::vector<double>& gains) const {
  gains.assign(solver_.all_free().size(), 0.0);
  for (const FreeBody& body : bodies_.free()) {
    if (body.mover < 0) continue;
    const auto begin = static_cast<std::size_t>(solver_.begin(body.mover));
    for (std::size_t row = 0; row < body.axes.size(); ++row) {
      gains[begin + row] = time / duration * (solver_.all_free()[begin + row] - body.velocity[body.axes[row]]);
    }
  }
}

// Velocities are those of the middle of the step before: they lack half a step of what the loads do.
void StepEquations::find_lags(double duration) { find_gains(0.5 * scene_.stepping().step, duration, lags_); }

// A substep is shorter than a step, and lags behind by half a step all the same. So what nothing holds goes on by what
// is between. Whether anything does so.
bool StepEquations::find_drifts(double duration) {
  drifts_.clear();
  const double between = 0.5 * (scene_.stepping().step - duration);
  if (!(between > 0.0)) return false;
  find_gains(between, duration, drifts_);
  const auto hold = [&](int mover) {
    if (mover >= 0) std::fill_n(drifts_.begin() + solver_.begin(mover), solver_.count(mover), 0.0);
  };
  for (const LimitedRow& row : solver_.limited()) hold(row.a), hold(row.b);
  bool held = true;
  while (held) {
    held = false;
    for (const ContactRows& rows : solver_.contacts()) {
      const double drift = solver_.speed(rows, normal_row, drifts_);
      const double miss = rows.target[normal_row] - solver_.speed(rows, normal_row, solver_.all_velocities());
      if (!(rows.impulse[normal_row] > 0.0) && !(drift < 0.0 && miss > drift)) continue;
      for (const int mover : {rows.a, rows.b}) {
        if (mover < 0) continue;
        const auto begin = drifts_.begin() + solver_.begin(mover);
        held = held || std::any_of(begin, begin + solver_.count(mover), [](double each) { return each != 0.0; });
        hold(mover);
      }
    }
  }
  return true;
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
    converged = solver_.solve(stepping.most_iterations(), stepping.residual(), true);
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

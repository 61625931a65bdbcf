#include "physics/native/newton_solver.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// So many iterations have to leave less than this share of the error.
constexpr double enough = 0.5;
constexpr int patience = 8;

// Islands of more movers seldom end after more iterations than these. Then softer contacts come next, with as many as
// there may be in all. So they do after all others where a hand has so many joints.
constexpr std::size_t many_movers = 8;
constexpr int most_of_many = 40, joints_of_hand = 16;

constexpr double first_level = 0.5;  // of the softness of contacts, where nothing else ends

constexpr double most_harder = 100.0;  // a contact is made, under a load

}  // namespace

bool NewtonSolver::solve(int iterations, double tolerance, bool again) {
  if (!again) {
    islands_.find(*this);
    first_ = velocities_;
  }
  const std::size_t size = velocities_.size();
  for (std::vector<double>* numbers : {&residual_, &turnover_, &direction_, &saved_, &start_, &found_}) {
    numbers->resize(size);
  }
  iterations_ = 0;
  bool converged = true;
  for (std::size_t i = 0; i < islands_.count(); ++i) {
    const Island& island = islands_[i];
    if (island.free()) {
      copy(island, free_, velocities_);
      continue;
    }
    const bool solved = solve_island(island, iterations, tolerance);
    converged = converged && solved;
    keep_impulses(island);
    if (error(island) <= tolerance) balance(island);  // what is left of an error would be blown up
  }
  return converged;
}

void NewtonSolver::recover() {
  for (std::size_t i = 0; i < islands_.count(); ++i) {
    if (!islands_[i].free()) recover(islands_[i]);
  }
}

// Copies numbers of the island's velocities.
void NewtonSolver::copy(const Island& island, const std::vector<double>& from, std::vector<double>& to) const {
  for (const int i : island.movers) std::copy_n(from.data() + begin(i), count(i), to.data() + begin(i));
}

// Contacts that give way by more than they may are made as much harder as it takes, and not by more than `most_harder`:
// where walls close on a body nothing helps. Whether there were any.
bool NewtonSolver::harden(const Island& island) {
  bool any = false;
  for (const std::size_t k : island.contacts) {
    FrictionLaw& law = contacts_[k].law;
    const double most_given = contacts_[k].gives, gives = law.normal_softness * contacts_[k].response.impulse[2];
    if (law.compliant || !(gives > most_given)) continue;
    const double share = std::max(0.5 * most_given / gives, 1.0 / most_harder);
    law.normal_softness *= share;
    law.tangential_softness *= share;
    any = true;
  }
  return any;
}

// Of several solutions that one is taken which goes on from the state: where something that was squeezed has let go,
// the step is solved once more from friction that holds it.
bool NewtonSolver::solve_island(const Island& island, int iterations, double tolerance) {
  const bool many = island.movers.size() > many_movers && iterations > most_of_many;
  const bool hand =
      std::any_of(island.movers.begin(), island.movers.end(), [this](int i) { return count(i) >= joints_of_hand; });
  const int tried = many ? most_of_many : iterations, softer = many || hand ? iterations : 0;
  int left = tried;
  soft_left_ = softer;
  copy(island, velocities_, start_);
  const double error = coulomb_error(island, false);
  for (const std::size_t k : island.contacts) contacts_[k].first_miss = contacts_[k].miss[normal_row];
  bool converged = iterate(island, left, tolerance, error, false);
  left += iterations - tried;
  if (converged) find_gone(island);
  if (converged && soft_left_ == softer && were_squeezed()) {
    soft_left_ = 0;
    const std::size_t gone = gone_.size();
    copy(island, velocities_, found_);
    copy(island, start_, velocities_);
    coulomb_error(island, false);
    bound_by_start(island);
    int most = left / 2;
    left -= most;
    const bool held = iterate(island, most, tolerance, bounded_error(island, most, tolerance), true);
    left += most;
    if (held) find_gone(island);
    if (!held || gone_.size() >= gone) {
      copy(island, found_, velocities_);
      coulomb_error(island, false);
    }
    soft_left_ = softer;
  }
  if (converged && harden(island)) {
    const bool was_softer = soft_left_ < softer;
    soft_left_ = softer;
    converged = was_softer ? find_gradually(island, 0.0, tolerance)
                           : iterate(island, left, tolerance, coulomb_error(island, false), false);
  }
  iterations_ += iterations - left;
  return converged;
}

// Newton's method on Coulomb's law, from velocities with that error. Where it does not get on, it goes on from those
// under friction with fixed bounds.
bool NewtonSolver::iterate(const Island& island, int& left, double tolerance, double error, bool bounded) {
  while (error > tolerance) {
    copy(island, velocities_, saved_);
    double next = error;
    for (int tries = 0; tries < patience && left > 0 && find_direction(island); ++tries) {
      keep_directions(island);
      add_step(island, 1.0);
      --left;
      next = coulomb_error(island, true);
      if (next <= tolerance && stopped_) next = coulomb_error(island, false);
      if (next < enough * error || next <= tolerance) break;
    }
    if (next < enough * error || next <= tolerance) {
      error = next;
      continue;
    }
    copy(island, bounded ? saved_ : start_, velocities_);
    coulomb_error(island, false);
    bounded ? bound_by_normals(island) : bound_by_start(island);
    bounded = true;
    if (left > 0) --left;  // a round counts, also one that finds no direction
    error = bounded_error(island, left, tolerance);
    if (left > 0 || error <= tolerance) continue;
    if (soft_left_ > 0) {
      tresca_error(island);
      if (find_gradually(island, first_level, tolerance)) return true;
    }
    int more = patience;
    minimize(island, more, tolerance);
    return false;
  }
  return true;
}

// Keeps the directions of what slides before a step.
void NewtonSolver::keep_directions(const Island& island) {
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = contacts_[k];
    rows.direction = rows.response.regime == Regime::slides ? rows.miss : ContactVector{};
    rows.direction[normal_row] = 0.0;
  }
}

void NewtonSolver::add_step(const Island& island, double length) {
  for (const int i : island.movers) {
    const double* const direction = direction_.data() + begin(i);
    for (int j = 0; j < count(i); ++j) velocities(i)[j] += length * direction[j];
  }
}

// Takes the rest of the residual out, mover by mover: so velocities change by the impulses to the last digit, and what
// one body gives another one gets.
void NewtonSolver::balance(const Island& island) {
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
    const int count = mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    double* const rest = residual_.data() + mover.begin;
    factors_.assign(inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia),
                    inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia) + count * count);
    double* const m = factors_.data();
    for (int k = 0; k < count; ++k) {  // L D L' by columns; linear ones stand alone
      for (int j = k + 1; j < count; ++j) {
        if (m[j * count + k] == 0.0) continue;
        const double factor = m[j * count + k] / m[k * count + k];
        for (int l = j; l < count; ++l) m[l * count + j] -= factor * m[l * count + k];
        rest[j] -= factor * rest[k];
      }
    }
    for (int k = count; k-- > 0;) {
      double sum = rest[k];
      for (int j = k + 1; j < count; ++j) sum -= m[j * count + k] * rest[j];
      rest[k] = sum / m[k * count + k];
      velocities[k] -= rest[k];
    }
  }
}

// How the velocities would answer if bodies in each other were asked to part by their `recovery` faster, while
// everything that presses or sticks goes on doing so. It moves them, and speeds up nothing.
void NewtonSolver::recover(const Island& island) {
  const auto penetrates = [](const auto& rows) { return rows.recovery != 0.0; };
  const bool any =
      std::any_of(island.contacts.begin(), island.contacts.end(),
                  [&](std::size_t k) { return penetrates(contacts_[k]); }) ||
      std::any_of(island.limited.begin(), island.limited.end(), [&](std::size_t k) { return penetrates(limited_[k]); });
  if (!any) return;
  for (const int i : island.movers) std::fill_n(residual_.begin() + begin(i), count(i), 0.0);
  const auto press = [&](const RowSides& sides, int row, double impulse) {
    for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
      double* const residual = residual_.data() + mover.begin;
      for (int j = 0; j < mover.count; ++j) residual[j] -= jacobian[row * mover.count + j] * impulse;
    });
  };
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = contacts_[k];
    const double leaving = std::max(0.0, rows.target[2] - rows.miss[2] - rows.still);
    const double asked = std::max(0.0, rows.recovery - leaving);
    const bool sticks = rows.response.regime == Regime::sticks && rows.impulse[2] > 0.0;
    const bool presses = rows.impulse[2] > 0.0 || asked > 0.0;
    FrictionLaw law = rows.law;
    if (!sticks) law.friction = 0.0;
    respond_as(presses ? Regime::sticks : Regime::open, law, {}, rows.response);
    if (presses) press(rows, normal_row, asked / law.normal_softness);
  }
  for (const std::size_t k : island.limited) {
    LimitedRow& row = limited_[k];
    if (row.recovery == 0.0) continue;
    row.slope = 1.0 / row.softness;
    press(row, 0, row.recovery / row.softness);
  }
  if (find_direction(island)) copy(island, direction_, recovery_);
}

}  // namespace energymargin

#include "physics/solver/newton_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/solver/kernels.hpp"

namespace energymargin {
namespace {

// So many iterations have to leave less than this share of the error.
constexpr double enough = 0.5;
constexpr int patience = 6;

// Sweeps at first, and most at a time; and iterations that go on from them.
constexpr int first_sweeps = 32;
constexpr int most_sweeps = 128;
constexpr int most_after_sweeps = 16;

// The first of these are whole steps; later, of which most have gone in circles, only every third.
constexpr int whole_steps = 3;
constexpr double shorter_step = 0.6;

// Errors are told as a share of the impulses, or of this share of the momenta where impulses are next to nothing.
constexpr double least_turnover = 1e-3;

// A load that presses contacts in by more than this is borne by harder ones [m/s].
constexpr double most_given = 0.01;
constexpr double most_harder = 20.0;

double limited_impulse(const LimitedRow& row, double miss) {
  return std::min(std::max(miss / row.softness, row.low), row.high);
}

double limited_slope(const LimitedRow& row, double miss) {
  const double impulse = miss / row.softness;
  return impulse > row.low && impulse < row.high ? 1.0 / row.softness : 0.0;
}

}  // namespace

bool NewtonSolver::solve(int iterations, double tolerance) {
  islands_.find(*this);
  return solve_again(iterations, tolerance);
}

bool NewtonSolver::solve_again(int iterations, double tolerance) {
  const std::size_t size = velocities_.size();
  for (std::vector<double>* numbers : {&residual_, &turnover_, &direction_}) numbers->resize(size);
  misses_.resize(contacts_.size());
  responses_.resize(contacts_.size());
  directions_.resize(contacts_.size());
  limited_misses_.resize(limited_.size());
  limited_slopes_.resize(limited_.size());
  limited_impulses_.resize(limited_.size());
  iterations_ = 0;
  bool converged = true;
  for (std::size_t i = 0; i < islands_.count(); ++i) {
    const Island& island = islands_[i];
    if (island.free()) {
      for (const int mover : island.movers) std::copy_n(free(mover), count(mover), velocities(mover));
      continue;
    }
    const bool solved = solve(island, iterations, tolerance);
    converged = converged && solved;
    for (const int k : island.contacts) {
      contacts_[static_cast<std::size_t>(k)].impulse = responses_[static_cast<std::size_t>(k)].impulse;
    }
    for (const int k : island.limited) {
      LimitedRow& row = limited_[static_cast<std::size_t>(k)];
      row.impulse = limited_impulse(row, limited_misses_[static_cast<std::size_t>(k)]);
    }
    if (solved) balance(island);  // what is left of an error would be blown up
    recover(island);
  }
  return converged;
}

void NewtonSolver::save(const Island& island) {
  saved_.resize(velocities_.size());
  for (const int i : island.movers) std::copy_n(velocities(i), count(i), saved_.data() + begin(i));
}

// Contacts that give way by more than that are made as much harder as it takes, and not by more than `most_harder`:
// where walls close on a body nothing helps. Whether there were any.
bool NewtonSolver::harden(const Island& island) {
  bool any = false;
  for (const int c : island.contacts) {
    const auto k = static_cast<std::size_t>(c);
    FrictionLaw& law = contacts_[k].law;
    const double gives = law.normal_softness * responses_[k].impulse[2];
    if (!(gives > most_given)) continue;
    const double share = std::max(0.5 * most_given / gives, 1.0 / most_harder);
    law.normal_softness *= share;
    law.tangential_softness *= share;
    any = true;
  }
  return any;
}

bool NewtonSolver::solve(const Island& island, int iterations, double tolerance) {
  int left = iterations;
  int sweeps = 0;
  double error = coulomb_error(island, false);
  bool hardened = false;
  while (true) {
    if (error <= tolerance) {
      if (hardened || !harden(island)) break;
      hardened = true;
      error = coulomb_error(island, false);
      continue;
    }
    if (left == 0) break;
    save(island);
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
    if (left == 0) break;
    for (const int i : island.movers) std::copy_n(saved_.data() + begin(i), count(i), velocities(i));
    sweeps = sweeps == 0 ? first_sweeps : std::min(2 * sweeps, most_sweeps);
    --left;
    error = go_on_from_sweeps(island, sweeps, left, tolerance);
  }
  iterations_ += iterations - left;
  if (error <= tolerance) return true;
  if (sweeps == 0) {
    sweeps_.start(island);
    sweeps_.run(island, first_sweeps);
  }
  take_swept(island);
  return false;
}

// Residual of the equations, turnover of its terms, and responses, at the velocities.
template <typename Respond, typename RespondLimited>
double NewtonSolver::evaluate(const Island& island, const Respond& respond, const RespondLimited& respond_limited) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    const double* velocities = velocities_.data() + mover.begin;
    const double* free = free_.data() + mover.begin;
    changes_.resize(static_cast<std::size_t>(mover.count));
    double* const change = changes_.data();
    for (int j = 0; j < mover.count; ++j) change[j] = velocities[j] - free[j];
    for (int j = 0; j < mover.count; ++j) {
      const double momentum = dot(inertia + j * mover.count, change, mover.count);
      residual_[static_cast<std::size_t>(mover.begin + j)] = momentum;
      turnover_[static_cast<std::size_t>(mover.begin + j)] = std::abs(momentum);
    }
  }
  const auto take = [&](int index, std::size_t begin, const double* impulse, int rows) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* jacobian = numbers_.data() + begin;
    double* residual = residual_.data() + mover.begin;
    double* turnover = turnover_.data() + mover.begin;
    if (mover.count == usual_count && rows == 3) return take_contact(jacobian, impulse, residual, turnover);
    for (int j = 0; j < mover.count; ++j) {
      double sum = 0.0;
      for (int row = 0; row < rows; ++row) sum += impulse[row] * jacobian[row * mover.count + j];
      residual[j] -= sum;
      turnover[j] += std::abs(sum);
    }
  };
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    const ContactRows& rows = contacts_[k];
    const ContactVector speeds_now = speeds(rows, velocities_);
    for (std::size_t row = 0; row < 3; ++row) misses_[k][row] = rows.target[row] - speeds_now[row];
    respond(k);
    if (responses_[k].regime == Regime::open) continue;
    take(rows.a, rows.of_a, responses_[k].impulse.data(), 3);
    take(rows.b, rows.of_b, responses_[k].impulse.data(), 3);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    const LimitedRow& row = limited_[k];
    limited_misses_[k] = row.target - speed(row, 0, velocities_);
    const double impulse = respond_limited(k);
    take(row.a, row.of_a, &impulse, 1);
    take(row.b, row.of_b, &impulse, 1);
  }
  return error(island);
}

// After a step, what slid and would go on the other way has stopped on the way: it sticks, before one can tell.
double NewtonSolver::coulomb_error(const Island& island, bool after_step) {
  stopped_ = false;
  const auto respond = [this, after_step](std::size_t k) {
    const ContactVector& miss = misses_[k];
    const auto& [x, y] = directions_[k];
    const bool turns_round = after_step && miss[2] > 0.0 && x * miss[0] + y * miss[1] < 0.0;
    if (turns_round) {
      stopped_ = true;
      return respond_as(Regime::sticks, contacts_[k].law, miss, responses_[k]);
    }
    coulomb(contacts_[k].law, miss, responses_[k]);
  };
  return evaluate(island, respond, [this](std::size_t k) {
    const LimitedRow& row = limited_[k];
    limited_slopes_[k] = limited_slope(row, limited_misses_[k]);
    return limited_impulse(row, limited_misses_[k]);
  });
}

// At its limits if the impulse that was predicted says so, and not the velocity alone; else it is linear.
double NewtonSolver::augmented_limited(std::size_t k) {
  const LimitedRow& row = limited_[k];
  const double asked =
      predicted_limited_[k] + limited_weights_[k] * (limited_misses_[k] - row.softness * predicted_limited_[k]);
  const bool free = asked > row.low && asked < row.high;
  limited_slopes_[k] = free ? 1.0 / row.softness : 0.0;
  return free ? limited_misses_[k] / row.softness : std::min(std::max(asked, row.low), row.high);
}

// The largest residual of a mover as a share of what is turned over there, in units of its inertia.
double NewtonSolver::error(const Island& island) const {
  double worst = 0.0;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    double error = 0.0, turnover = 0.0;
    for (int j = 0; j < mover.count; ++j) {
      const auto index = static_cast<std::size_t>(mover.begin + j);
      const double mass = inertia[j * mover.count + j];
      const double momentum = mass * (std::abs(velocities_[index]) + std::abs(free_[index]));
      const double turned = std::max(turnover_[index], least_turnover * momentum);
      const double inverse = inverse_diagonal_[index];
      const double squared = residual_[index] * residual_[index] * inverse;
      if (!(squared <= error)) error = squared;  // also what is no number
      turnover = std::max(turnover, turned * turned * inverse);
    }
    if (error != 0.0 && !(error / turnover <= worst)) worst = error / turnover;
  }
  return std::isnan(worst) ? std::numeric_limits<double>::infinity() : std::sqrt(worst);
}

// Of what slides, before a step.
void NewtonSolver::keep_directions(const Island& island) {
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    directions_[k] = {0.0, 0.0};
    if (responses_[k].regime == Regime::slides) directions_[k] = {misses_[k][0], misses_[k][1]};
  }
}

// Newton's method from the impulses that the sweeps found. Each step predicts those that the next one starts from.
double NewtonSolver::go_on_from_sweeps(const Island& island, int sweeps, int& left, double tolerance) {
  if (sweeps == first_sweeps) sweeps_.start(island);
  sweeps_.run(island, sweeps);
  predicted_.resize(contacts_.size());
  for (const int i : island.movers) {
    std::copy_n(sweeps_.velocities().data() + begin(i), count(i), velocities(i));
  }
  for (const int i : island.contacts) {
    predicted_[static_cast<std::size_t>(i)] = sweeps_.impulse(static_cast<std::size_t>(i));
  }
  predicted_limited_.resize(limited_.size());
  limited_weights_.resize(limited_.size());
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    predicted_limited_[k] = sweeps_.limited_impulse(k);
    limited_weights_[k] = 1.0 / (sweeps_.limited_inverse_mass(k) + limited_[k].softness);
  }
  double error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_after_sweeps && left > 0; ++i) {
    evaluate(
        island, [this](std::size_t k) { augmented(contacts_[k].law, misses_[k], predicted_[k], responses_[k]); },
        [this](std::size_t k) { return limited_impulses_[k] = augmented_limited(k); });
    if (!find_direction(island)) return error;
    const double length = i < whole_steps || i % 3 == 2 ? 1.0 : shorter_step;
    for (const int c : island.contacts) {
      const auto k = static_cast<std::size_t>(c);
      ContactVector whole = responses_[k].impulse;
      const ContactVector changes = speeds(contacts_[k], direction_);
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
          whole[row] -= responses_[k].slope[row][column] * changes[column];
        }
      }
      for (std::size_t row = 0; row < 3; ++row) predicted_[k][row] += length * (whole[row] - predicted_[k][row]);
    }
    for (const int c : island.limited) {
      const auto k = static_cast<std::size_t>(c);
      const double whole = limited_impulses_[k] - limited_slopes_[k] * speed(limited_[k], 0, direction_);
      predicted_limited_[k] += length * (whole - predicted_limited_[k]);
    }
    add_step(island, length);
    --left;

    error = coulomb_error(island, false);
    if (error <= tolerance) break;
  }
  return error;
}

// Impulses and velocities that belong together, where nothing better was found.
void NewtonSolver::take_swept(const Island& island) {
  for (const int i : island.movers) {
    std::copy_n(sweeps_.velocities().data() + begin(i), count(i), velocities(i));
  }
  for (const int i : island.contacts) {
    responses_[static_cast<std::size_t>(i)].impulse = sweeps_.impulse(static_cast<std::size_t>(i));
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    limited_misses_[k] = sweeps_.limited_impulse(k) * limited_[k].softness;
  }
}

bool NewtonSolver::find_direction(const Island& island) {
  assemble(island);
  if (!matrix_.factor()) return false;
  std::vector<double>& direction = direction_;
  changes_.resize(island.first.size());
  double* const local = changes_.data();
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    for (int j = 0; j < mover.count; ++j)
      local[islands_.row(i) + j] = -residual_[static_cast<std::size_t>(mover.begin + j)];
  }
  matrix_.solve(local);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::copy_n(local + islands_.row(i), mover.count, direction.begin() + mover.begin);
  }
  return true;
}

void NewtonSolver::assemble(const Island& island) {
  matrix_.reset(island.first);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    for (int j = 0; j < mover.count; ++j) {
      std::copy_n(inertia + j * mover.count, mover.count, matrix_.row(islands_.row(i) + j) + islands_.row(i));
    }
  }
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    if (responses_[k].regime != Regime::open) add_contact_block(contacts_[k], responses_[k]);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    if (limited_slopes_[k] != 0.0) add_limited_block(limited_[k], limited_slopes_[k]);
  }
}

// Adds J' slope J, side by side.
template <typename Add>
void NewtonSolver::add_blocks(const RowSides& sides, const Add& add) {
  if (sides.a >= 0) add(sides.a, sides.of_a, sides.a, sides.of_a);
  if (sides.b < 0) return;
  add(sides.b, sides.of_b, sides.b, sides.of_b);
  if (sides.a < 0) return;
  add(sides.a, sides.of_a, sides.b, sides.of_b);
  add(sides.b, sides.of_b, sides.a, sides.of_a);
}

void NewtonSolver::add_contact_block(const RowSides& sides, const ContactResponse& response) {
  add_blocks(sides, [&](int left, std::size_t of_left, int right, std::size_t of_right) {
    const Mover& from = movers_[static_cast<std::size_t>(left)];
    const Mover& to = movers_[static_cast<std::size_t>(right)];
    const double* const along = numbers_.data() + of_left;
    const double* const jacobian = numbers_.data() + of_right;
    if (from.count == usual_count && to.count == usual_count) {
      double answer[contact_size];
      answer_contact(response, jacobian, answer);
      for (int i = 0; i < usual_count; ++i) {
        add_contact_row(along + i, answer, matrix_.row(islands_.row(left) + i) + islands_.row(right));
      }
      return;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      changes_.assign(static_cast<std::size_t>(to.count), 0.0);
      for (std::size_t k = 0; k < 3; ++k) {
        const double slope = response.slope[row][k];
        const double* const of_row = jacobian + k * static_cast<std::size_t>(to.count);
        if (slope != 0.0) add_multiple(slope, of_row, to.count, changes_.data());
      }
      for (int i = 0; i < from.count; ++i) {
        const double factor = along[row * static_cast<std::size_t>(from.count) + static_cast<std::size_t>(i)];
        if (factor != 0.0)
          add_multiple(factor, changes_.data(), to.count, matrix_.row(islands_.row(left) + i) + islands_.row(right));
      }
    }
  });
}

void NewtonSolver::add_limited_block(const RowSides& sides, double slope) {
  add_blocks(sides, [&](int left, std::size_t of_left, int right, std::size_t of_right) {
    const Mover& from = movers_[static_cast<std::size_t>(left)];
    const Mover& to = movers_[static_cast<std::size_t>(right)];
    const double* const along = numbers_.data() + of_left;
    for (int i = 0; i < from.count; ++i) {
      if (along[i] == 0.0) continue;
      add_multiple(slope * along[i], numbers_.data() + of_right, to.count,
                   matrix_.row(islands_.row(left) + i) + islands_.row(right));
    }
  });
}

void NewtonSolver::add_step(const Island& island, double length) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    for (int j = mover.begin; j < mover.begin + mover.count; ++j) {
      velocities_[static_cast<std::size_t>(j)] += length * direction_[static_cast<std::size_t>(j)];
    }
  }
}

// Takes the rest of the residual out, mover by mover: so velocities change by the impulses to the last digit, and what
// one body gives another one gets.
void NewtonSolver::balance(const Island& island) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const int count = mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    double* const rest = residual_.data() + mover.begin;
    factors_.assign(inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia),
                    inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia) + count * count);
    double* const m = factors_.data();
    for (int k = 0; k < count; ++k) {  // L D L' by columns; linear ones stand alone
      for (int j = k + 1; j < count; ++j) {
        const double factor = m[j * count + k] / m[k * count + k];
        if (factor == 0.0) continue;
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

// How the velocities would answer if overlapping bodies were asked to part by their `recovery` faster, while everything
// that presses or sticks goes on doing so. It moves them, and speeds up nothing.
void NewtonSolver::recover(const Island& island) {
  const auto overlaps = [](const auto& rows) { return rows.recovery > 0.0; };
  const bool any = std::any_of(island.contacts.begin(), island.contacts.end(),
                               [&](int k) { return overlaps(contacts_[static_cast<std::size_t>(k)]); }) ||
                   std::any_of(island.limited.begin(), island.limited.end(),
                               [&](int k) { return overlaps(limited_[static_cast<std::size_t>(k)]); });
  if (!any) return;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::fill_n(residual_.begin() + mover.begin, mover.count, 0.0);
  }
  const auto press = [&](int index, std::size_t begin, int row, double impulse) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* jacobian = numbers_.data() + begin + row * mover.count;
    for (int j = 0; j < mover.count; ++j) residual_[static_cast<std::size_t>(mover.begin + j)] -= jacobian[j] * impulse;
  };
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    const ContactRows& rows = contacts_[k];
    const double leaving = std::max(0.0, rows.target[2] - misses_[k][2]);
    const double asked = std::max(0.0, rows.recovery - leaving);
    const bool sticks = responses_[k].regime == Regime::sticks && rows.impulse[2] > 0.0;
    const bool presses = rows.impulse[2] > 0.0 || asked > 0.0;
    FrictionLaw law = rows.law;
    if (!sticks) law.friction = 0.0;
    respond_as(presses ? Regime::sticks : Regime::open, law, {}, responses_[k]);
    if (!presses) continue;
    const double normal = 1.0 / rows.law.normal_softness;
    press(rows.a, rows.of_a, 2, normal * asked);
    press(rows.b, rows.of_b, 2, normal * asked);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    const LimitedRow& row = limited_[k];
    if (row.recovery <= 0.0) continue;
    limited_slopes_[k] = 1.0 / row.softness;
    press(row.a, row.of_a, 0, row.recovery / row.softness);
    press(row.b, row.of_b, 0, row.recovery / row.softness);
  }
  if (!find_direction(island)) return;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::copy_n(direction_.begin() + mover.begin, mover.count, recovery_.begin() + mover.begin);
  }
}

}  // namespace energymargin

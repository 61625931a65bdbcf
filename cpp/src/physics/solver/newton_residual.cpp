// The residual A (v - v_free) - sum of J' impulse(J v) at the velocities, with the impulses and their slopes there.

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/solver/kernels.hpp"
#include "physics/solver/newton_solver.hpp"

namespace energymargin {
namespace {

// An error is relative to the impulses, or to this share of the momenta where the impulses are nearly zero.
constexpr double least_turnover = 1e-3;

}  // namespace

// Residual of the equations, turnover of its terms, and responses, at the velocities.
template <typename Respond, typename RespondLimited>
double NewtonSolver::evaluate(const Island& island, const Respond& respond, const RespondLimited& respond_limited) {
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
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
  const auto take = [&](const RowSides& sides, const double* impulse, int rows) {
    for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
      double* residual = residual_.data() + mover.begin;
      double* turnover = turnover_.data() + mover.begin;
      if (mover.count == usual_count && rows == 3) return take_contact(jacobian, impulse, residual, turnover);
      for (int j = 0; j < mover.count; ++j) {
        double sum = 0.0;
        for (int row = 0; row < rows; ++row) sum += impulse[row] * jacobian[row * mover.count + j];
        residual[j] -= sum;
        turnover[j] += std::abs(sum);
      }
    });
  };
  for (const std::size_t k : island.contacts) {
    const ContactRows& rows = contacts_[k];
    const ContactVector speeds_now = speeds(rows, velocities_);
    for (std::size_t row = 0; row < 3; ++row) misses_[k][row] = rows.target[row] - speeds_now[row];
    respond(k);
    if (responses_[k].regime != Regime::open) take(rows, responses_[k].impulse.data(), 3);
  }
  for (const std::size_t k : island.limited) {
    const LimitedRow& row = limited_[k];
    limited_misses_[k] = row.target - speed(row, 0, velocities_);
    const double impulse = respond_limited(k);
    take(row, &impulse, 1);
  }
  return error(island);
}

// What slid before a step and would go on the other way after it has stopped on the way: it sticks, before one can
// tell.
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
    limited_slopes_[k] = row.slope_at(limited_misses_[k]);
    return row.impulse_at(limited_misses_[k]);
  });
}

// Each responds to what was predicted of it as well.
double NewtonSolver::augmented_error(const Island& island) {
  return evaluate(
      island, [this](std::size_t k) { augmented(contacts_[k].law, misses_[k], predicted_[k], responses_[k]); },
      [this](std::size_t k) { return limited_impulses_[k] = augmented_limited(k); });
}

// The impulse of a row is at a limit if the one that was predicted says so, and not the velocity alone; else linear.
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
    const Mover& mover = this->mover(i);
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

}  // namespace energymargin

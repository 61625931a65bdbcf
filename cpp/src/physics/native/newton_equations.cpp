// The residual A (v - v_free) - sum of J' impulse(J v) at the velocities, with the impulses and their slopes there. And
// a step of Newton's method: the matrix A + sum of J' slope J of an island, and the direction that it gives.

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/native/kernels.hpp"
#include "physics/native/newton_solver.hpp"

namespace energymargin {
namespace {

// An error is relative to the impulses, or to this share of the momenta where the impulses are nearly zero.
constexpr double least_turnover = 1e-3;

// The normal row of a direction is zero.
double slip_along(const ContactRows& rows) {
  double along = rows.direction[0] * rows.miss[0] + rows.direction[1] * rows.miss[1];
  for (std::size_t row = usual_rows; row < static_cast<std::size_t>(rows.law.rows); ++row) {
    along += rows.direction[row] * rows.miss[row];
  }
  return along;
}

}  // namespace

// Whether contacts without rows may close at the velocities, after so much of the direction.
void NewtonSolver::look_at_open(const Island& island, double length) {
  for (const std::size_t k : island.open) {
    double change = 0.0;
    for_each_side(open_[k], [&](const Mover& mover, const double* weights) {
      for (int j = 0; j < mover.count; ++j) {
        const auto at = static_cast<std::size_t>(mover.begin + j);
        const double more = length == 0.0 ? 0.0 : length * direction_[at];
        change += weights[j] * std::abs(velocities_[at] + more - first_[at]);
      }
    });
    open_[k].closes = open_[k].closes || !(change < 1.0);
  }
}

// Residual of the equations, turnover of its terms, and responses, at the velocities.
template <typename Respond>
double NewtonSolver::evaluate(const Island& island, const Respond& respond) {
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
  look_at_open(island, 0.0);
  const auto take = [&](const RowSides& sides, const double* impulse, int rows) {
    for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
      double* residual = residual_.data() + mover.begin;
      double* turnover = turnover_.data() + mover.begin;
      if (mover.count == usual_count && rows == usual_rows) return take_contact(jacobian, impulse, residual, turnover);
      for (int j = 0; j < mover.count; ++j) {
        double sum = 0.0;
        for (int row = 0; row < rows; ++row) sum += impulse[row] * jacobian[row * mover.count + j];
        residual[j] -= sum;
        turnover[j] += std::abs(sum);
      }
    });
  };
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = contacts_[k];
    const ContactVector speeds_now = speeds(rows, velocities_);
    const int count = rows.law.rows;
    for (std::size_t row = 0; row < most_rows; ++row) rows.miss[row] = rows.target[row] - speeds_now[row];
    respond(rows);
    if (rows.response.regime != Regime::open) take(rows, rows.response.impulse.data(), count);
  }
  for (const std::size_t k : island.limited) {
    LimitedRow& row = limited_[k];
    row.miss = row.target - speed(row, 0, velocities_);
    const double linear = row.miss / row.softness;
    row.slope = linear > row.low && linear < row.high ? 1.0 / row.softness : 0.0;
    const double impulse = row.impulse_of_miss();
    take(row, &impulse, 1);
  }
  return error(island);
}

// What slid before a step and would go on the other way after it has stopped on the way: it sticks.
double NewtonSolver::coulomb_error(const Island& island, bool after_step) {
  stopped_ = false;
  const auto respond = [this, after_step](ContactRows& rows) {
    const bool turns_round = after_step && rows.miss[normal_row] > 0.0 && slip_along(rows) < 0.0;
    if (!turns_round) return coulomb(rows.law, rows.miss, rows.response);
    stopped_ = true;
    respond_as(Regime::sticks, rows.law, rows.miss, rows.response);
  };
  return evaluate(island, respond);
}

// Friction is at most the bounds that are known.
double NewtonSolver::tresca_error(const Island& island) {
  return evaluate(island, [](ContactRows& rows) { tresca(rows.law, rows.miss, rows.bound, rows.response); });
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

bool NewtonSolver::find_direction(const Island& island) {
  assemble(island);
  if (!matrix_.factor()) return false;
  changes_.resize(island.first.size());
  double* const local = changes_.data();
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
    for (int j = 0; j < mover.count; ++j)
      local[islands_.row(i) + j] = -residual_[static_cast<std::size_t>(mover.begin + j)];
  }
  matrix_.solve(local);
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
    std::copy_n(local + islands_.row(i), mover.count, direction_.begin() + mover.begin);
  }
  return true;
}

void NewtonSolver::assemble(const Island& island) {
  matrix_.reset(island.first);
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
    const double* inertia = inertias_.data() + mover.inertia;
    for (int j = 0; j < mover.count; ++j) {
      std::copy_n(inertia + j * mover.count, mover.count, matrix_.row(islands_.row(i) + j) + islands_.row(i));
    }
  }
  for (const std::size_t k : island.contacts) {
    if (contacts_[k].response.regime != Regime::open) add_contact_block(contacts_[k]);
  }
  for (const std::size_t k : island.limited) {
    if (limited_[k].slope != 0.0) add_limited_block(limited_[k]);
  }
}

// Calls visit(mover, rows) for the sides.
template <typename Visit>
void NewtonSolver::for_each_mover(const RowSides& sides, const Visit& visit) {
  if (sides.a >= 0) visit(sides.a, numbers_.data() + sides.of_a);
  if (sides.b >= 0) visit(sides.b, numbers_.data() + sides.of_b);
}

// Adds J' slope J, side by side.
void NewtonSolver::add_contact_block(const ContactRows& rows) {
  for_each_mover(rows, [&](int right, const double* jacobian) {
    const int columns = count(right);
    const auto row_count = static_cast<std::size_t>(rows.law.rows);
    changes_.resize(row_count * static_cast<std::size_t>(columns));
    double* const answer = changes_.data();
    if (row_count == usual_rows) {
      const bool usual = columns == usual_count;
      usual ? answer_contact(rows.response, jacobian, usual_count, answer)
            : answer_contact(rows.response, jacobian, columns, answer);
      return for_each_mover(rows, [&](int left, const double* along) {
        const int row = islands_.row(left);
        double* const entries = matrix_.row(row) + islands_.row(right);
        const std::ptrdiff_t stride = matrix_.stride(row);
        if (usual && count(left) == usual_count) return add_usual_block(along, answer, entries, stride);
        energymargin::add_contact_block(along, count(left), answer, columns, entries, stride);
      });
    }
    std::fill(changes_.begin(), changes_.end(), 0.0);
    for (std::size_t row = 0; row < row_count; ++row) {
      for (std::size_t k = 0; k < row_count; ++k) {
        const double slope = rows.response.slope[row][k];
        const std::size_t width = static_cast<std::size_t>(columns);
        if (slope != 0.0) add_multiple(slope, jacobian + k * width, columns, answer + row * width);
      }
    }
    for_each_mover(rows, [&](int left, const double* along) {
      for (int row = 0; row < rows.law.rows; ++row) {
        for (int i = 0; i < count(left); ++i) {
          const double factor = along[row * count(left) + i];
          if (factor == 0.0) continue;
          add_multiple(factor, answer + row * columns, columns,
                       matrix_.row(islands_.row(left) + i) + islands_.row(right));
        }
      }
    });
  });
}

void NewtonSolver::add_limited_block(const LimitedRow& row) {
  for_each_mover(row, [&](int right, const double* jacobian) {
    for_each_mover(row, [&](int left, const double* along) {
      for (int i = 0; i < count(left); ++i) {
        if (along[i] == 0.0) continue;
        add_multiple(row.slope * along[i], jacobian, count(right),
                     matrix_.row(islands_.row(left) + i) + islands_.row(right));
      }
    });
  });
}

}  // namespace energymargin

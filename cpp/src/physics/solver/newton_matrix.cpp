// A step of Newton's method: the matrix A + sum of J' slope J of an island, and the direction that it gives.

#include <algorithm>

#include "physics/solver/kernels.hpp"
#include "physics/solver/newton_solver.hpp"

namespace energymargin {

bool NewtonSolver::find_direction(const Island& island) {
  assemble(island);
  if (!matrix_.factor()) return false;
  std::vector<double>& direction = direction_;
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
    std::copy_n(local + islands_.row(i), mover.count, direction.begin() + mover.begin);
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
    if (responses_[k].regime != Regime::open) add_contact_block(contacts_[k], responses_[k]);
  }
  for (const std::size_t k : island.limited) {
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
    const Mover& from = mover(left);
    const Mover& to = mover(right);
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
    const Mover& from = mover(left);
    const Mover& to = mover(right);
    const double* const along = numbers_.data() + of_left;
    for (int i = 0; i < from.count; ++i) {
      if (along[i] == 0.0) continue;
      add_multiple(slope * along[i], numbers_.data() + of_right, to.count,
                   matrix_.row(islands_.row(left) + i) + islands_.row(right));
    }
  });
}

}  // namespace energymargin

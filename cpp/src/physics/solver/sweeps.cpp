#include "physics/solver/sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "physics/solver/kernels.hpp"

namespace energymargin {

void Sweeps::start(const Island& island) {
  inverses_.resize(system_.inertias().size());
  velocities_.resize(system_.all_free().size());
  answers_.clear();
  for (const int i : island.movers) {
    invert(i);
    const VelocitySystem::Mover& mover = system_.mover(i);
    std::copy_n(system_.all_free().data() + mover.begin, mover.count, velocities_.data() + mover.begin);
  }
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = system_.contacts()[k];
    rows.swept = rows.inverse_masses = {};
    answer(rows, rows.law.rows, rows.inverse_masses.data());
  }
  for (const std::size_t k : island.limited) {
    LimitedRow& row = system_.limited()[k];
    row.swept = row.inverse_mass = 0.0;
    answer(row, 1, &row.inverse_mass);
  }
}

// Gauss and Jordan's way; an inertia needs no pivots.
void Sweeps::invert(int index) {
  const VelocitySystem::Mover& mover = system_.mover(index);
  const int count = mover.count;
  double* const m = inverses_.data() + mover.inertia;
  std::copy_n(system_.inertias().data() + mover.inertia, count * count, m);
  for (int k = 0; k < count; ++k) {
    const double inverse = 1.0 / m[k * count + k];
    m[k * count + k] = 1.0;
    for (int j = 0; j < count; ++j) m[k * count + j] *= inverse;
    for (int l = 0; l < count; ++l) {
      const double factor = m[l * count + k];
      if (l == k || factor == 0.0) continue;
      m[l * count + k] = 0.0;
      for (int j = 0; j < count; ++j) m[l * count + j] -= factor * m[k * count + j];
    }
  }
}

// What velocities answer to impulses along rows: products with the inverses of their inertias.
void Sweeps::answer(RowSides& sides, int rows, double* inverse_masses) {
  const auto add = [&](int index, std::size_t begin, std::size_t& at) {
    at = answers_.size();
    if (index < 0) return;
    const VelocitySystem::Mover& mover = system_.mover(index);
    answers_.resize(at + static_cast<std::size_t>(rows * mover.count));
    for (int row = 0; row < rows; ++row) {
      const double* jacobian = system_.numbers(begin) + row * mover.count;
      double* const of_row = answers_.data() + at + row * mover.count;
      for (int j = 0; j < mover.count; ++j) {
        of_row[j] = dot(inverses_.data() + mover.inertia + j * mover.count, jacobian, mover.count);
      }
      inverse_masses[row] += dot(jacobian, of_row, mover.count);
    }
  };
  add(sides.a, sides.of_a, sides.answer_a);
  add(sides.b, sides.of_b, sides.answer_b);
}

void Sweeps::run(const Island& island, int sweeps) {
  for (int i = 0; i < sweeps; ++i) {
    for (const std::size_t k : island.limited) resolve(system_.limited()[k]);
    if (i % 2 == 0) {
      for (const std::size_t k : island.contacts) resolve(system_.contacts()[k]);
    } else {
      for (auto k = island.contacts.rbegin(); k != island.contacts.rend(); ++k) resolve(system_.contacts()[*k]);
    }
  }
}

void Sweeps::push(const RowSides& sides, int row, double impulse) {
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const VelocitySystem::Mover& mover = system_.mover(index);
    const double* answer = answers_.data() + begin + row * mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    for (int j = 0; j < mover.count; ++j) velocities[j] += answer[j] * impulse;
  };
  add(sides.a, sides.answer_a);
  add(sides.b, sides.answer_b);
}

void Sweeps::resolve(ContactRows& rows) {
  const auto set = [&](std::size_t row, double impulse) {
    const double change = impulse - rows.swept[row];
    if (change == 0.0) return;
    rows.swept[row] = impulse;
    push(rows, static_cast<int>(row), change);
  };
  const auto asked = [&](std::size_t row, double softness) {
    const double speed = system_.speed(rows, static_cast<int>(row), velocities_);
    const double miss = rows.target[row] - speed - softness * rows.swept[row];
    return rows.swept[row] + miss / (rows.inverse_masses[row] + softness);
  };
  set(2, std::max(0.0, asked(2, rows.law.normal_softness)));
  if (rows.law.friction == 0.0) return;
  ContactVector along{};
  double squared = 0.0;
  for (int row = 0; row < rows.law.rows; ++row) {
    if (row == normal_row) continue;
    const double impulse = along[static_cast<std::size_t>(row)] = asked(row, rows.law.tangential_softness);
    squared += impulse * impulse;
  }
  const double most = rows.law.friction * rows.swept[normal_row];
  const double length = std::sqrt(squared);
  for (int row = 0; row < rows.law.rows; ++row) {
    if (row == normal_row) continue;
    const double impulse = along[static_cast<std::size_t>(row)];
    set(row, length > most ? impulse * (most / length) : impulse);
  }
}

void Sweeps::resolve(LimitedRow& row) {
  const double miss = row.target - system_.speed(row, 0, velocities_) - row.softness * row.swept;
  const double asked = row.swept + miss / (row.inverse_mass + row.softness);
  const double impulse = std::min(std::max(asked, row.low), row.high);
  push(row, 0, impulse - row.swept);
  row.swept = impulse;
}

}  // namespace energymargin

#include "physics/solver/sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "physics/solver/kernels.hpp"

namespace energymargin {

void Sweeps::start(const Island& island) {
  contacts_.resize(system_.contacts().size());
  limited_.resize(system_.limited().size());
  inverses_.resize(system_.inertias().size());
  velocities_.resize(system_.all_free().size());
  answers_.clear();
  for (const int i : island.movers) {
    invert(i);
    const VelocitySystem::Mover& mover = system_.mover(i);
    std::copy_n(system_.all_free().data() + mover.begin, mover.count, velocities_.data() + mover.begin);
  }
  for (const std::size_t k : island.contacts) {
    const ContactRows& rows = system_.contacts()[k];
    contacts_[k] = {};
    contacts_[k].of_a = answer(rows.a, rows.of_a, 3, contacts_[k].inverse_masses.data());
    contacts_[k].of_b = answer(rows.b, rows.of_b, 3, contacts_[k].inverse_masses.data());
  }
  for (const std::size_t k : island.limited) {
    const LimitedRow& row = system_.limited()[k];
    limited_[k] = {};
    limited_[k].of_a = answer(row.a, row.of_a, 1, &limited_[k].inverse_mass);
    limited_[k].of_b = answer(row.b, row.of_b, 1, &limited_[k].inverse_mass);
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

// What a mover's velocities answer to impulses along rows: products with the inverse of its inertia.
std::size_t Sweeps::answer(int index, std::size_t begin, int rows, double* inverse_masses) {
  const std::size_t at = answers_.size();
  if (index < 0) return at;
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
  return at;
}

void Sweeps::run(const Island& island, int sweeps) {
  for (int i = 0; i < sweeps; ++i) {
    for (const std::size_t k : island.limited) resolve_limited(k);
    if (i % 2 == 0) {
      for (const std::size_t k : island.contacts) resolve_contact(k);
    } else {
      for (auto k = island.contacts.rbegin(); k != island.contacts.rend(); ++k) resolve_contact(*k);
    }
  }
}

void Sweeps::push(const RowSides& sides, int row, std::size_t of_a, std::size_t of_b, double impulse) {
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const VelocitySystem::Mover& mover = system_.mover(index);
    const double* answer = answers_.data() + begin + row * mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    for (int j = 0; j < mover.count; ++j) velocities[j] += answer[j] * impulse;
  };
  add(sides.a, of_a);
  add(sides.b, of_b);
}

void Sweeps::resolve_contact(std::size_t k) {
  const ContactRows& rows = system_.contacts()[k];
  Swept& swept = contacts_[k];
  const auto set = [&](int row, double impulse) {
    const double change = impulse - swept.impulse[static_cast<std::size_t>(row)];
    if (change == 0.0) return;
    swept.impulse[static_cast<std::size_t>(row)] = impulse;
    push(rows, row, swept.of_a, swept.of_b, change);
  };
  const auto asked = [&](int row, double softness) {
    const auto i = static_cast<std::size_t>(row);
    const double miss = rows.target[i] - system_.speed(rows, row, velocities_) - softness * swept.impulse[i];
    return swept.impulse[i] + miss / (swept.inverse_masses[i] + softness);
  };
  set(2, std::max(0.0, asked(2, rows.law.normal_softness)));
  if (rows.law.friction == 0.0) return;
  double x = asked(0, rows.law.tangential_softness);
  double y = asked(1, rows.law.tangential_softness);
  const double most = rows.law.friction * swept.impulse[2];
  const double length = std::sqrt(x * x + y * y);
  if (length > most) {
    x *= most / length;
    y *= most / length;
  }
  set(0, x);
  set(1, y);
}

void Sweeps::resolve_limited(std::size_t k) {
  const LimitedRow& row = system_.limited()[k];
  SweptRow& swept = limited_[k];
  const double miss = row.target - system_.speed(row, 0, velocities_) - row.softness * swept.impulse;
  const double asked = swept.impulse + miss / (swept.inverse_mass + row.softness);
  const double impulse = std::min(std::max(asked, row.low), row.high);
  push(row, 0, swept.of_a, swept.of_b, impulse - swept.impulse);
  swept.impulse = impulse;
}

}  // namespace energymargin

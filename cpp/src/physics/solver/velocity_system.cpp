#include "physics/solver/velocity_system.hpp"

#include "physics/solver/kernels.hpp"

namespace energymargin {

void VelocitySystem::clear() {
  movers_.clear();
  inertias_.clear();
  inverse_diagonal_.clear();
  kept_ = 0;
  free_.clear();
  velocities_.clear();
  recovery_.clear();
  numbers_.clear();
  contacts_.clear();
  limited_.clear();
}

int VelocitySystem::add_mover(int count) {
  const int begin = static_cast<int>(velocities_.size());
  movers_.push_back({begin, count, inertias_.size()});
  const auto size = static_cast<std::size_t>(begin + count);
  inertias_.resize(inertias_.size() + static_cast<std::size_t>(count * count), 0.0);
  free_.resize(size, 0.0);
  velocities_.resize(size, 0.0);
  recovery_.resize(size, 0.0);
  return static_cast<int>(movers_.size()) - 1;
}

// Keeps the inverse diagonals of movers that are new.
void VelocitySystem::keep_diagonals() {
  for (; kept_ < movers_.size(); ++kept_) {
    const Mover& mover = movers_[kept_];
    for (int i = 0; i < mover.count; ++i) {
      inverse_diagonal_.push_back(1.0 / inertias_[mover.inertia + static_cast<std::size_t>(i * mover.count + i)]);
    }
  }
}

void VelocitySystem::add_sides(RowSides& sides, int a, int b, int rows) {
  keep_diagonals();
  sides.a = a;
  sides.b = b == a ? -1 : b;
  const auto add = [&](int mover, std::size_t& begin) {
    begin = numbers_.size();
    if (mover >= 0) numbers_.resize(begin + static_cast<std::size_t>(rows * count(mover)), 0.0);
  };
  add(sides.a, sides.of_a);
  add(sides.b, sides.of_b);
}

ContactRows& VelocitySystem::add_contact(int a, int b) {
  contacts_.emplace_back();
  add_sides(contacts_.back(), a, b, 3);
  return contacts_.back();
}

LimitedRow& VelocitySystem::add_limited(int a, int b) {
  limited_.emplace_back();
  add_sides(limited_.back(), a, b, 1);
  return limited_.back();
}

double VelocitySystem::inverse_mass(const RowSides& sides, int row) const {
  double sum = 0.0;
  for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
    jacobian += row * mover.count;
    const double* inverses = inverse_diagonal_.data() + mover.begin;
    for (int i = 0; i < mover.count; ++i) sum += jacobian[i] * jacobian[i] * inverses[i];
  });
  return sum;
}

double VelocitySystem::speed(const RowSides& sides, int row, const std::vector<double>& velocities) const {
  double sum = 0.0;
  for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
    sum += dot(jacobian + row * mover.count, velocities.data() + mover.begin, mover.count);
  });
  return sum;
}

ContactVector VelocitySystem::speeds(const ContactRows& rows, const std::vector<double>& velocities) const {
  ContactVector sums{};
  for_each_side(rows, [&](const Mover& mover, const double* jacobian) {
    const double* const of_mover = velocities.data() + mover.begin;
    if (mover.count == usual_count) return add_speeds(jacobian, of_mover, sums);
    for (std::size_t row = 0; row < 3; ++row) {
      sums[row] += dot(jacobian + row * static_cast<std::size_t>(mover.count), of_mover, mover.count);
    }
  });
  return sums;
}

}  // namespace energymargin

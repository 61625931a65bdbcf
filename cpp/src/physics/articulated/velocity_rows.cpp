#include "physics/articulated/velocity_rows.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

using Pair = Eigen::Map<Eigen::Array2d>;
using ConstPair = Eigen::Map<const Eigen::Array2d>;

inline void add_products(const double* factors, const double* velocities, std::size_t pairs, Eigen::Array2d& sum) {
  for (std::size_t i = 0; i < 2 * pairs; i += 2) sum += ConstPair(factors + i) * ConstPair(velocities + i);
}

inline void add_multiple(const double* response, double impulse, std::size_t pairs, double* velocities) {
  for (std::size_t i = 0; i < 2 * pairs; i += 2) Pair(velocities + i) += ConstPair(response + i) * impulse;
}

inline double square(double value) { return value * value; }

}  // namespace

void VelocityRows::clear(std::size_t velocities) {
  motors.clear();
  joints.clear();
  normals.clear();
  frictions.clear();
  splits.clear();
  numbers_.clear();
  velocities_.assign(velocities, 0.0);
  split_velocities_.assign(velocities, 0.0);
}

inline double VelocityRows::speed(const VelocityRow& row, const double* velocities) const {
  const double* numbers = numbers_.data() + row.numbers;
  Eigen::Array2d sum = Eigen::Array2d::Zero();
  add_products(numbers, velocities + row.a.begin, row.a.pairs, sum);
  add_products(numbers + 4 * row.a.pairs, velocities + row.b.begin, row.b.pairs, sum);
  return sum[0] + sum[1];
}

inline void VelocityRows::push(const VelocityRow& row, double impulse, double* velocities) const {
  const double* numbers = numbers_.data() + row.numbers;
  add_multiple(numbers + 2 * row.a.pairs, impulse, row.a.pairs, velocities + row.a.begin);
  add_multiple(numbers + 4 * row.a.pairs + 2 * row.b.pairs, impulse, row.b.pairs, velocities + row.b.begin);
}

inline double VelocityRows::change(const VelocityRow& row) const {
  return (row.target - row.softness * row.impulse - speed(row, velocities_.data())) * row.effective_mass;
}

// A row that nothing can move along has no mass, and no impulse.
void VelocityRows::start(VelocityRow& row, double impulse) {
  const double inverse = row.inverse_effective_mass + row.softness;
  const bool moves = inverse > std::numeric_limits<double>::epsilon();
  row.effective_mass = moves ? 1.0 / inverse : 0.0;
  row.inverse_effective_mass = moves ? inverse : 0.0;
  row.impulse = moves ? std::clamp(impulse, row.low, row.high) : 0.0;
  if (row.impulse != 0.0) push(row, row.impulse, velocities_.data());
}

bool VelocityRows::solve(int rounds, int joint_rounds, double tolerance) {
  const auto until_small = [&](const auto& iterate) {
    for (int i = 0; i < rounds; ++i) {
      if (iterate(i) <= tolerance) return true;
    }
    return false;
  };
  const bool apart = splits.empty() || until_small([&](int) { return iterate_splits(); });
  return until_small([&](int round) { return iterate(round, joint_rounds); }) && apart;
}

double VelocityRows::iterate_splits() {
  double most = 0.0;
  double* velocities = split_velocities_.data();
  for (Split& split : splits) {
    const VelocityRow& row = normals[split.normal];
    const double unclamped = split.impulse + (split.target - speed(row, velocities)) * row.effective_mass;
    const double impulse = std::max(unclamped, 0.0);
    push(row, impulse - split.impulse, velocities);
    most = std::max(most, square((impulse - split.impulse) * row.inverse_effective_mass));
    split.impulse = impulse;
  }
  return most;
}

// Every other round takes the joints the other way round, so that none has always the last word.
double VelocityRows::iterate(int round, int joint_rounds) {
  double most_of_joints = 0.0;
  for (int i = 0; i < joint_rounds; ++i) {
    most_of_joints = 0.0;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      most_of_joints = std::max(most_of_joints, resolve(joints[round % 2 == 1 ? j : joints.size() - 1 - j]));
    }
  }
  double most = most_of_joints;
  for (VelocityRow& row : motors) most = std::max(most, resolve(row));
  for (VelocityRow& row : normals) most = std::max(most, resolve(row));
  for (Friction& friction : frictions) most = std::max(most, resolve(friction));
  return most;
}

// Returns the square of the change of the velocity along the row.
inline double VelocityRows::set_impulse(VelocityRow& row, double impulse) {
  const double changed = impulse - row.impulse;
  row.impulse = impulse;
  push(row, changed, velocities_.data());
  return square(changed * row.inverse_effective_mass);
}

inline double VelocityRows::resolve(VelocityRow& row) {
  return set_impulse(row, std::min(std::max(row.impulse + change(row), row.low), row.high));
}

inline double VelocityRows::resolve(Friction& friction) {
  const double radius = friction.coefficient * normals[friction.normal].impulse;
  VelocityRow& first = friction.first;
  VelocityRow& second = friction.second;
  double of_first = first.impulse + change(first);
  double of_second = second.impulse + change(second);
  const double length = square(of_first) + square(of_second);
  if (length > square(radius)) {
    const double share = radius / std::sqrt(length);
    of_first *= share;
    of_second *= share;
  }
  return set_impulse(first, of_first) + set_impulse(second, of_second);
}

}  // namespace energymargin

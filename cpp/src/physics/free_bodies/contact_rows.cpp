#include "physics/free_bodies/contact_rows.hpp"

#include <algorithm>
#include <limits>

namespace energymargin {
namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

Twist none() { return {Eigen::Array2d::Zero(), Eigen::Array2d::Zero(), Eigen::Array2d::Zero()}; }

// The impulse that a change of a body's velocities asks for.
inline double asked(const RowSide& side, const Twist* changes) {
  const Twist& change = changes[side.body];
  const Eigen::Array2d both = side.scaled[0] * change[0] + side.scaled[1] * change[1] + side.scaled[2] * change[2];
  return both[0] + both[1];
}

inline void push(const RowSide& side, double impulse, Twist* changes) {
  Twist& change = changes[side.body];
  for (std::size_t axis = 0; axis < 3; ++axis) change[axis] += side.response[axis] * impulse;
}

// Moves the row's impulse towards its target, within the limits; returns the square of the velocity that this changes.
inline double resolve(const ContactRow& row, double target, double& impulse, double low, double high, Twist* changes) {
  double slip = asked(row.first, changes);
  if (row.second.body >= 0) slip += asked(row.second, changes);
  double change = target - slip;
  const double unclamped = impulse + change;
  const double clamped = std::min(std::max(unclamped, low), high);
  if (clamped != unclamped) change = clamped - impulse;
  impulse = clamped;
  push(row.first, change, changes);
  if (row.second.body >= 0) push(row.second, change, changes);
  const double velocity = change * row.inverse_effective_mass;
  return velocity * velocity;
}

}  // namespace

void ContactRows::clear(std::size_t bodies) {
  motors_.clear();
  normals_.clear();
  frictions_.clear();
  changes_.assign(bodies, none());
  split_twists_.assign(bodies, none());
}

MotorRow& ContactRows::add_motor() { return motors_.emplace_back(); }
NormalRow& ContactRows::add_normal() { return normals_.emplace_back(); }
FrictionRow& ContactRows::add_friction() { return frictions_.emplace_back(); }

void ContactRows::apply(const ContactRow& row) {
  push(row.first, row.impulse, changes_.data());
  if (row.second.body >= 0) push(row.second, row.impulse, changes_.data());
}

void ContactRows::apply_split(const NormalRow& row) {
  push(row.first, row.split_impulse, split_twists_.data());
  if (row.second.body >= 0) push(row.second, row.split_impulse, split_twists_.data());
}

// Friction comes before the normal impulses that it presses with: so bodies do not go into each other at the end of a
// round, and a stack takes fewer rounds.
double ContactRows::iterate() {
  double most = 0.0;
  for (MotorRow& row : motors_) {
    most = std::max(most, resolve(row, row.target, row.impulse, -row.limit, row.limit, changes_.data()));
  }
  for (FrictionRow& row : frictions_) {
    const double most_friction = row.friction * normals_[row.normal].impulse;
    if (most_friction == 0.0 && row.impulse == 0.0) continue;
    most = std::max(most, resolve(row, row.target, row.impulse, -most_friction, most_friction, changes_.data()));
  }
  for (NormalRow& row : normals_) {
    most = std::max(most, resolve(row, row.target, row.impulse, 0.0, no_limit, changes_.data()));
  }
  return most;
}

double ContactRows::iterate_split_impulses() {
  double most = 0.0;
  for (NormalRow& row : normals_) {
    if (row.split_target == 0.0) continue;
    most = std::max(most, resolve(row, row.split_target, row.split_impulse, 0.0, no_limit, split_twists_.data()));
  }
  return most;
}

}  // namespace energymargin

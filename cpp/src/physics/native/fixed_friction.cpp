// Where Newton's method goes on from if it goes in circles: velocities under friction with fixed bounds (Tresca), which
// are the least of a convex function. And what has let go, though it may go on.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/native/kernels.hpp"
#include "physics/native/newton_solver.hpp"

namespace energymargin {
namespace {

// A line search ends where the slope along it is this share of the one that it began with.
constexpr double flat_share = 0.1;
constexpr int most_lengths = 40;

// A contact presses as a step begins if its miss is more than this, and parts if it is less than its negative [m/s].
constexpr double least_pressing = 1e-7;

// A contact touches whose bodies would part by less than this [m/s].
constexpr double least_parting = 1e-6;

// A contact lets go whose impulse falls to less than this share in one step.
constexpr double most_dropped = 0.5;

// Slower than this nothing slides at first [m/s].
constexpr double least_slip = 1e-3;

double slip(const ContactRows& rows) {
  double squared = 0.0;
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows.law.rows); ++row) {
    if (row != normal_row) squared += rows.miss[row] * rows.miss[row];
  }
  return std::sqrt(squared);
}

}  // namespace

// Goes to the velocities under friction with fixed bounds. Their error by Coulomb's law.
double NewtonSolver::bounded_error(const Island& island, int& left, double tolerance) {
  minimize(island, left, tolerance);
  return coulomb_error(island, false);
}

// Velocities under friction with fixed bounds: the least of a convex function. Whether it was found.
bool NewtonSolver::minimize(const Island& island, int& left, double tolerance) {
  while (tresca_error(island) > tolerance) {
    if (left == 0 || !find_direction(island)) return false;
    --left;
    add_step(island, step_length(island));
  }
  return true;
}

// The length of a step along the direction, at whose end the function hardly falls any more.
double NewtonSolver::step_length(const Island& island) {
  look_at_open(island, 1.0);
  double at_start = 0.0, bends = 0.0;  // slope and curvature of the kinetic part
  for (const int i : island.movers) {
    const Mover& mover = this->mover(i);
    const double* const along = direction_.data() + mover.begin;
    changes_.resize(static_cast<std::size_t>(mover.count));
    for (int j = 0; j < mover.count; ++j) {
      const auto at = static_cast<std::size_t>(mover.begin + j);
      changes_[static_cast<std::size_t>(j)] = velocities_[at] - free_[at];
    }
    for (int j = 0; j < mover.count; ++j) {
      const double* const row = inertias_.data() + mover.inertia + j * mover.count;
      at_start += along[j] * dot(row, changes_.data(), mover.count);
      bends += along[j] * dot(row, along, mover.count);
    }
  }
  for (const std::size_t k : island.contacts) contacts_[k].along = speeds(contacts_[k], direction_);
  for (const std::size_t k : island.limited) limited_[k].along = speed(limited_[k], 0, direction_);
  const auto slope = [&](double length) { return at_start + length * bends - pull(island, length); };
  double low = 0.0, high = 1.0;
  double at_low = slope(low), at_high = slope(high);
  const double level = flat_share * std::abs(at_low);
  if (at_high <= level) return high;
  for (int i = 0; i < most_lengths; ++i) {  // the way of Illinois
    const double length = (low * at_high - high * at_low) / (at_high - at_low);
    const double here = slope(length);
    if (std::abs(here) <= level) return length;
    (here < 0.0 ? low : high) = length;
    (here < 0.0 ? at_low : at_high) = here;
    (here < 0.0 ? at_high : at_low) *= 0.5;
  }
  return low > 0.0 ? low : high;
}

// What impulses with fixed bounds of friction do along the direction, after so much of it.
double NewtonSolver::pull(const Island& island, double length) const {
  double sum = 0.0;
  for (const std::size_t k : island.contacts) {
    const ContactRows& rows = contacts_[k];
    const auto after = [&](int row) {
      return rows.miss[static_cast<std::size_t>(row)] - length * rows.along[static_cast<std::size_t>(row)];
    };
    const double normal = after(normal_row);
    if (normal > 0.0) sum += normal / rows.law.normal_softness * rows.along[normal_row];
    if (!(rows.bound > 0.0) || !(rows.law.friction > 0.0)) continue;
    double squared = 0.0, product = 0.0;
    for (int row = 0; row < rows.law.rows; ++row) {
      if (row == normal_row) continue;
      squared += after(row) * after(row);
      product += after(row) * rows.along[static_cast<std::size_t>(row)];
    }
    const double slip = std::sqrt(squared), softness = rows.law.tangential_softness;
    sum += product * (slip > rows.bound * softness ? rows.bound / slip : 1.0 / softness);
  }
  for (const std::size_t k : island.limited) {
    const LimitedRow& row = limited_[k];
    const double impulse = (row.miss - length * row.along) / row.softness;
    sum += std::min(std::max(impulse, row.low), row.high) * row.along;
  }
  return sum;
}

// At the start: where that presses, or touches, and hardly slips, friction may hold anything at first.
void NewtonSolver::bound_by_start(const Island& island) {
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = contacts_[k];
    const bool holds = rows.first_miss > -least_parting && slip(rows) <= least_slip;
    rows.bound =
        holds ? std::numeric_limits<double>::infinity() : rows.law.friction * rows.response.impulse[normal_row];
  }
}

void NewtonSolver::bound_by_normals(const Island& island) {
  for (const std::size_t k : island.contacts) {
    ContactRows& rows = contacts_[k];
    rows.bound = rows.law.friction * std::max(0.0, rows.miss[normal_row]) / rows.law.normal_softness;
  }
}

// Finds those that pressed, and do so by far less now, and those that touched, without a preload, and part.
void NewtonSolver::find_gone(const Island& island) {
  gone_.clear();
  for (const std::size_t k : island.contacts) {
    const double first = contacts_[k].first_miss, now = contacts_[k].miss[normal_row];
    const bool has_gone =
        first > least_pressing ? now < most_dropped * first : first > -least_parting && now < -least_pressing;
    if (has_gone) gone_.push_back(k);
  }
}

// Whether two of them oppose each other: one alone could not have been held.
bool NewtonSolver::were_squeezed() const {
  const auto oppose = [this](const ContactRows& one, const ContactRows& other) {
    for (const auto& [i, of_one] : {std::pair{one.a, one.of_a}, {one.b, one.of_b}}) {
      if (i < 0 || (i != other.a && i != other.b)) continue;
      const std::size_t first = static_cast<std::size_t>(normal_row * count(i));
      const double* const along = numbers(of_one + first);
      const double* const back = numbers((i == other.a ? other.of_a : other.of_b) + first);
      const int width = count(i) == usual_count ? 3 : count(i);  // turns are no squeeze
      double sum = 0.0;
      for (int j = 0; j < width; ++j)
        sum += along[j] * back[j] * inverse_diagonal_[static_cast<std::size_t>(begin(i) + j)];
      if (sum < 0.0) return true;
    }
    return false;
  };
  for (std::size_t i = 1; i < gone_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (oppose(contacts_[gone_[i]], contacts_[gone_[j]])) return true;
    }
  }
  return false;
}

}  // namespace energymargin

#include "search/polish.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace energymargin::search {
namespace {

// Of the strategy.
constexpr double target_rate = 2.0 / 11.0;  // of successes, at which the size of the steps stays
constexpr double rate_memory = 1.0 / 12.0;

// Standard deviations of the first changes, drawn evenly in their logarithm: of wrenches in units of the strongest one,
// of durations in units of each.
constexpr double least_deviation = 0.01;
constexpr double largest_deviation = 0.3;
constexpr double smallest_size = 0.01;  // of the changes, as a share of those at first
constexpr int first_failures = 10;      // one after the other, and so many more a variable, end it
constexpr int failures_a_variable = 10;
constexpr int most_pushes = 5;  // edges that are not cut any more
constexpr int duration = -1;    // instead of an axis

}  // namespace

EvolutionStrategy::EvolutionStrategy(const Eigen::VectorXd& deviations, ompl::RNG& rng)
    : rng_(rng),
      success_rate_(target_rate),
      factor_(deviations.asDiagonal()),
      step_(Eigen::VectorXd::Zero(deviations.size())),
      path_(step_),
      violation_(step_) {}

Eigen::VectorXd EvolutionStrategy::draw() {
  Eigen::VectorXd normal(step_.size());
  for (double& number : normal) number = rng_.gaussian01();
  step_ = factor_ * normal;
  return size_ * step_;
}

void EvolutionStrategy::tell(Outcome outcome) {
  if (outcome == Outcome::infeasible) return learn_violation();
  const bool success = outcome == Outcome::better;
  success_rate_ += rate_memory * ((success ? 1.0 : 0.0) - success_rate_);
  const double damping = 1.0 + 0.5 * static_cast<double>(step_.size());
  size_ *= std::exp((success_rate_ - target_rate) / (1.0 - target_rate) / damping);
  if (success) learn_success();
}

// The covariance grows along the steps that succeeded.
void EvolutionStrategy::learn_success() {
  const auto n = static_cast<double>(step_.size());
  const double memory = 2.0 / (n + 2.0);
  const double rate = 2.0 / (n * n + 6.0);
  path_ = (1.0 - memory) * path_ + std::sqrt(memory * (2.0 - memory)) * step_;
  const Eigen::VectorXd w = factor_.partialPivLu().solve(path_);
  const double squared = w.squaredNorm();
  const double keep = std::sqrt(1.0 - rate);
  const double gain = keep / squared * (std::sqrt(1.0 + rate * squared / (1.0 - rate)) - 1.0);
  factor_ = keep * factor_ + gain * path_ * w.transpose();
}

// It shrinks along those that broke the constraint.
void EvolutionStrategy::learn_violation() {
  const auto n = static_cast<double>(step_.size());
  const double memory = 1.0 / (n + 2.0);
  const double rate = 0.1 / (n + 2.0);
  violation_ = (1.0 - memory) * violation_ + memory * step_;
  const Eigen::VectorXd w = factor_.partialPivLu().solve(violation_);
  factor_ -= rate / w.squaredNorm() * violation_ * w.transpose();
}

void Polish::start(TimedEdges escape) {
  best_ = std::move(escape);
  cut_one();
  variables_ = variables();
  strategy_.emplace(first_deviations(), rng_);
  failures_ = 0;
}

bool Polish::goes_on() const {
  if (!strategy_) return false;
  const int most_failures = first_failures + failures_a_variable * static_cast<int>(variables_.size());
  return strategy_->size() > smallest_size && failures_ < most_failures;
}

const TimedEdges& Polish::draw() {
  const Eigen::VectorXd step = strategy_->draw();
  drawn_ = best_;
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    const auto [index, axis] = variables_[i];
    TimedEdge& edge = drawn_[index];
    const double change = step[static_cast<Eigen::Index>(i)];
    if (axis == duration) {
      const double steps = std::clamp(edge.steps + change * largest_.steps, 1.0, 1.0 * largest_.steps);
      edge.steps = static_cast<int>(std::lround(steps));
    } else {
      const double bound = largest_.wrenches[axis];
      edge.wrenches[axis] = std::clamp(edge.wrenches[axis] + change * bound, -bound, bound);
    }
  }
  return drawn_;
}

void Polish::tell(Outcome outcome) {
  if (outcome == Outcome::better) best_ = drawn_;
  failures_ = outcome == Outcome::better ? 0 : failures_ + 1;
  strategy_->tell(outcome);
}

// Any that has a wrench.
void Polish::cut_one() {
  std::vector<std::size_t> pushes;
  for (std::size_t i = 0; i < best_.size(); ++i) {
    if (!best_[i].wrenches.isZero(0.0)) pushes.push_back(i);
  }
  if (pushes.empty() || pushes.size() >= most_pushes) return;
  const auto any = static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(pushes.size()) - 1));
  TimedEdge& first = best_[pushes[any]];
  if (first.steps < 2) return;
  TimedEdge second = first;
  first.steps = rng_.uniformInt(1, first.steps - 1);
  second.steps -= first.steps;
  second.start += first.steps;
  best_.insert(best_.begin() + static_cast<std::ptrdiff_t>(pushes[any]) + 1, second);
}

std::vector<Polish::Variable> Polish::variables() const {
  std::vector<Variable> variables;
  for (std::size_t i = 0; i < best_.size(); ++i) {
    variables.emplace_back(i, duration);
    for (int axis = 0; axis < largest_.wrenches.size(); ++axis) {
      const int object = axis / wrench_axes * wrench_axes;
      const bool disturbed = !best_[i].wrenches.segment<wrench_axes>(object).isZero(0.0);
      if (disturbed && largest_.wrenches[axis] > 0.0) variables.emplace_back(i, axis);
    }
  }
  return variables;
}

Eigen::VectorXd Polish::first_deviations() {
  double strongest = 0.0;
  for (const auto& [index, axis] : variables_) {
    if (axis == duration) continue;
    strongest = std::max(strongest, std::abs(best_[index].wrenches[axis]) / largest_.wrenches[axis]);
  }
  const double deviation = std::exp(rng_.uniformReal(std::log(least_deviation), std::log(largest_deviation)));
  Eigen::VectorXd deviations(static_cast<Eigen::Index>(variables_.size()));
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    const auto& [index, axis] = variables_[i];
    const double steps = best_[index].steps / static_cast<double>(largest_.steps);
    deviations[static_cast<Eigen::Index>(i)] = deviation * (axis == duration ? steps : strongest);
  }
  return deviations;
}

}  // namespace energymargin::search

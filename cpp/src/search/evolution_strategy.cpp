#include "search/evolution_strategy.hpp"

#include <Eigen/LU>
#include <cmath>

namespace energymargin::search {
namespace {

constexpr double target_rate = 2.0 / 11.0;  // of successes, at which the size of the steps stays
constexpr double rate_memory = 1.0 / 12.0;

}  // namespace

EvolutionStrategy::EvolutionStrategy(const Eigen::VectorXd& deviations, ompl::RNG& rng)
    : rng_(rng),
      success_rate_(target_rate),
      factor_(deviations.asDiagonal()),
      step_(Eigen::VectorXd::Zero(deviations.size())),
      drawn_(step_),
      path_(step_),
      violation_(step_) {}

const Eigen::VectorXd& EvolutionStrategy::draw() {
  Eigen::VectorXd normal(dimension());
  for (double& number : normal) number = rng_.gaussian01();
  step_ = factor_ * normal;
  drawn_ = size_ * step_;
  return drawn_;
}

void EvolutionStrategy::tell(Outcome outcome) {
  if (outcome == Outcome::infeasible) return learn_violation();
  const bool success = outcome == Outcome::better;
  success_rate_ += rate_memory * ((success ? 1.0 : 0.0) - success_rate_);
  const double damping = 1.0 + 0.5 * static_cast<double>(dimension());
  size_ *= std::exp((success_rate_ - target_rate) / (1.0 - target_rate) / damping);
  if (success) learn_success();
}

// The covariance grows along the steps that succeeded.
void EvolutionStrategy::learn_success() {
  const auto n = static_cast<double>(dimension());
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
  const auto n = static_cast<double>(dimension());
  const double memory = 1.0 / (n + 2.0);
  const double rate = 0.1 / (n + 2.0);
  violation_ = (1.0 - memory) * violation_ + memory * step_;
  const Eigen::VectorXd w = factor_.partialPivLu().solve(violation_);
  factor_ -= rate / w.squaredNorm() * violation_ * w.transpose();
}

}  // namespace energymargin::search

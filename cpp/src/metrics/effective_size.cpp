#include "metrics/effective_size.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace energymargin {
namespace {

// Relative variance of one estimate: as measured or, if that is more, as of a lognormal distribution with the same
// variance of its logarithm, of which a few draws seldom show the long tail.
double relative_variance(const Eigen::VectorXd& estimates) {
  const auto n = static_cast<double>(estimates.size());
  const double mean = estimates.mean();
  const double measured = (estimates.array() - mean).square().sum() / (n - 1.0) / (mean * mean);
  std::vector<double> logarithms;
  for (const double estimate : estimates) {
    if (estimate > 0.0) logarithms.push_back(std::log(estimate));
  }
  const auto positive = static_cast<double>(logarithms.size());
  if (positive < 2.0) return measured;
  const Eigen::Map<const Eigen::ArrayXd> logs(logarithms.data(), static_cast<Eigen::Index>(logarithms.size()));
  const double spread = (logs - logs.mean()).square().sum() / (positive - 1.0);
  return std::max(measured, std::exp(spread) * n / positive - 1.0);
}

}  // namespace

double effective_size(const Eigen::VectorXd& estimates, int replicas) {
  const auto n = static_cast<double>(estimates.size());
  const double mean = estimates.mean();
  if (mean <= 0.0 || mean >= 1.0) return replicas;
  const double of_student = (n - 1.0) / (n - 3.0);  // the variance of Student's distribution
  const double least = -std::log(mean) / replicas;
  const double variance = std::max(relative_variance(estimates) / n * of_student, least);
  return std::max((1.0 - mean) / mean / variance, static_cast<double>(replicas));
}

}  // namespace energymargin

#include "energymargin/metrics/capture.hpp"

#include <cmath>

#include "../check.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "energymargin/search/est.hpp"

namespace energymargin {
namespace {

// Line 3 of Algorithm 2: EST(P_inf, M).
Tree energy_cost_field(const Problem& problem, int nodes, std::uint64_t seed, const std::atomic<bool>* stop) {
  search::BoundedProblem bounded(problem, nullptr, nodes, seed, stop);
  search::Est est(bounded, stream(seed, 0));
  est.solve(bounded.termination());
  return bounded.take_tree();
}

// Eq. 5 and 6: the likelihood that falls into a set.
double likelihood_inside(const Region& region, const Scene& scene, const Tree& tree, const Eigen::VectorXd& weights) {
  const Mask inside = Membership(region, scene)(tree.states);
  // Divided by the sum of the same numbers in the same order, so that a set of all nodes gives exactly 1.
  double sum = 0.0;
  double total = 0.0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    total += weights[i];
    if (inside(i)) sum += weights[i];
  }
  return sum / total;
}

std::optional<double> standard_error(const Eigen::VectorXd& values) {
  if (values.size() < 2) return std::nullopt;
  const double n = static_cast<double>(values.size());
  return std::sqrt((values.array() - values.mean()).square().sum() / (n * (n - 1.0)));
}

}  // namespace

Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate) {
  const Eigen::VectorXd weights = (-rate * (costs.array() - costs.minCoeff())).exp();
  return weights / weights.sum();
}

CaptureScore capture_score(const Problem& problem, const CaptureOptions& options) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("trees", options.trees, 1);
  require_at_least("threads", options.threads, 1);
  const double rate = options.rate.value_or(problem.rate);
  require_not_negative("rate", rate);
  validate(problem);

  const auto count = static_cast<std::size_t>(options.trees);
  CaptureScore score;
  score.trees.resize(count);
  parallel_for(count, options.threads, [&](std::size_t i) {
    score.trees[i] = energy_cost_field(problem, options.nodes, stream(options.seed, i), options.stop);
  });
  score.likelihoods = likelihoods(score.trees.front().costs, rate);
  const auto weigh = [&](const Region& region, auto& mean, std::optional<double>& error) {
    Eigen::VectorXd inside(options.trees);
    for (Eigen::Index i = 0; i < inside.size(); ++i) {
      const Tree& tree = score.trees[static_cast<std::size_t>(i)];
      inside[i] = likelihood_inside(region, problem.scene, tree, likelihoods(tree.costs, rate));
    }
    mean = inside.mean();
    error = standard_error(inside);
  };
  weigh(problem.captured, score.capture, score.capture_stderr);
  if (problem.succeeded) weigh(*problem.succeeded, score.success, score.success_stderr);
  if (problem.captured_any) weigh(*problem.captured_any, score.capture_any, score.capture_any_stderr);
  if (problem.succeeded_any) weigh(*problem.succeeded_any, score.success_any, score.success_any_stderr);
  return score;
}

}  // namespace energymargin

#include "energymargin/metrics/capture.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "base/check.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "search/exploration.hpp"

namespace energymargin {
namespace {

// A tree, and what it says of each set.
struct Grown {
  Tree tree;
  bool complete = false;
  int diverged = 0;  // rollouts
  std::vector<double> scores{};
  double heaviest = 0.0;  // likelihood of a node
};

// Line 3 of Algorithm 2: EST(P_inf, M); with a least likelihood EST(P_c, M), with c the cost at which it is reached.
Grown energy_cost_field(const Problem& problem, const CaptureOptions& options, double rate, std::uint64_t seed,
                        const Limit& limit) {
  search::ExplorationOptions exploration;
  exploration.nodes = options.nodes;
  exploration.nodes_per_edge = options.nodes_per_edge;
  if (options.least_likelihood > 0.0) exploration.bound = -std::log(options.least_likelihood) / rate;
  exploration.seed = seed;
  exploration.limit = limit;
  exploration.node_counter = options.made;
  search::Exploration field = search::explore(problem, exploration);
  return {std::move(field.tree), field.complete, field.diverged};
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

double standard_error(const Eigen::VectorXd& values) {
  const double n = static_cast<double>(values.size());
  return std::sqrt((values.array() - values.mean()).square().sum() / (n * (n - 1.0)));
}

// The sets that a problem has.
std::vector<const Region*> sets_of(const Problem& problem) {
  std::vector<const Region*> sets{&problem.captured};
  for (const auto* set : {&problem.succeeded, &problem.captured_any, &problem.succeeded_any}) {
    if (*set) sets.push_back(&**set);
  }
  return sets;
}

// Trees by their number. Those that count are the first ones, up to one that is not complete, or up to where the
// tolerance is met: so which they are does not depend on the threads.
class Forest {
 public:
  Forest(const Problem& problem, const CaptureOptions& options)
      : problem_(problem),
        options_(options),
        rate_(options.rate.value_or(problem.rate)),
        sets_(sets_of(problem)),
        most_(static_cast<std::size_t>(options.trees.value_or(options.tolerance ? most_trees : 1))) {}

  void grow() {
    const Limit enough = options_.limit.or_when(done_);
    parallel_for(most_, options_.threads, [&](std::size_t i) { grow_tree(i, enough); }, enough);
    if (grown_.count(0) == 0) grow_tree(0, enough);  // its root alone
  }

  CaptureScore score() {
    const std::size_t count = std::max<std::size_t>(counted_, 1);
    CaptureScore score;
    score.complete = options_.tolerance ? done_.load() : counted_ == most_;
    score.likelihoods = likelihoods(grown_.at(0).tree.costs, rate_);
    const auto take = [&](std::size_t set, auto& mean, std::optional<double>& error, Eigen::VectorXd& by_tree) {
      by_tree = scores(set, count);
      mean = by_tree.mean();
      if (count > 1) error = standard_error(by_tree);
    };
    std::size_t set = 0;
    take(set++, score.capture, score.capture_stderr, score.capture_by_tree);
    if (problem_.succeeded) take(set++, score.success, score.success_stderr, score.success_by_tree);
    if (problem_.captured_any) take(set++, score.capture_any, score.capture_any_stderr, score.capture_any_by_tree);
    if (problem_.succeeded_any) take(set++, score.success_any, score.success_any_stderr, score.success_any_by_tree);
    for (std::size_t i = 0; i < count; ++i) {
      score.resolution += grown_.at(i).heaviest / static_cast<double>(count);
      score.diverged += grown_.at(i).diverged;
      score.trees.push_back(std::move(grown_.at(i).tree));
    }
    return score;
  }

 private:
  void grow_tree(std::size_t index, const Limit& limit) {
    Grown grown = energy_cost_field(problem_, options_, rate_, stream(options_.seed, index), limit);
    if (!grown.complete && index > 0) return;
    const Eigen::VectorXd weights = likelihoods(grown.tree.costs, rate_);
    for (const Region* set : sets_) {
      grown.scores.push_back(likelihood_inside(*set, problem_.scene, grown.tree, weights));
    }
    grown.heaviest = weights.maxCoeff();
    const std::lock_guard<std::mutex> lock(mutex_);
    grown_.emplace(index, std::move(grown));
    count_trees();
  }

  void count_trees() {
    for (auto next = grown_.find(counted_); !done_ && next != grown_.end() && next->second.complete;
         next = grown_.find(counted_)) {
      ++counted_;
      if (options_.tolerance && counted_ >= fewest_trees && is_met(*options_.tolerance)) done_ = true;
    }
  }

  bool is_met(double tolerance) const {
    for (std::size_t set = 0; set < sets_.size(); ++set) {
      if (!(standard_error(scores(set, counted_)) <= tolerance)) return false;
    }
    return true;
  }

  // Of the first `count` trees.
  Eigen::VectorXd scores(std::size_t set, std::size_t count) const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) values[static_cast<Eigen::Index>(i)] = grown_.at(i).scores[set];
    return values;
  }

  const Problem& problem_;
  const CaptureOptions& options_;
  double rate_;
  std::vector<const Region*> sets_;
  std::size_t most_;
  std::mutex mutex_;
  std::map<std::size_t, Grown> grown_;
  std::size_t counted_ = 0;
  std::atomic<bool> done_{false};  //!< the tolerance is met
};

void validate(const CaptureOptions& options) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("nodes_per_edge", options.nodes_per_edge, 1);
  require_least_likelihood(options.least_likelihood);
  if (options.tolerance) require_positive("tolerance", *options.tolerance);
  if (options.trees)
    require_at_least(options.tolerance ? "trees with a tolerance" : "trees", *options.trees,
                     options.tolerance ? fewest_trees : 1);
  require_at_least("threads", options.threads, 1);
  if (options.rate) require_not_negative("rate", *options.rate);
}

}  // namespace

Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate) {
  const Eigen::ArrayXd above = costs.array() - costs.minCoeff();
  const Eigen::VectorXd weights = above.isFinite().select((-rate * above).exp(), 0.0);
  return weights / weights.sum();
}

void require_least_likelihood(double value) {
  if (!(value >= 0.0 && value < 1.0)) reject("least_likelihood", text(value), "at least 0 and below 1");
}

CaptureScore capture_score(const Problem& problem, const CaptureOptions& options) {
  validate(options);
  validate(problem);
  require_no_clock(problem, "capture_score");
  Forest forest(problem, options);
  forest.grow();
  return forest.score();
}

}  // namespace energymargin

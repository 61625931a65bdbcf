#include "energymargin/metrics/capture.hpp"

#include <algorithm>
#include <atomic>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "base/words.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "search/planners.hpp"

namespace energymargin {
namespace {

constexpr std::size_t set_count = 4;  // of sets that a problem may have, in the order of `set_scores`

struct ScoredTree {
  Tree tree;
  StepCounts counts;
  bool complete = false;
  int diverged = 0;                             // rollouts
  double resolution = 0.0;                      // likelihood of the heaviest node
  std::array<double, set_count> likelihoods{};  // inside each set, eq. 5 and 6
};

double likelihood_inside(const Membership& set, const Tree& tree, const Eigen::VectorXd& weights) {
  const Mask inside = set(tree.states);
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

// Trees by their number. The first ones count, up to one that is not complete, or where they meet the tolerance.
class Forest {
 public:
  Forest(const Problem& problem, const CaptureOptions& options)
      : problem_(problem),
        options_(options),
        rate_(options.rate.value_or(problem.rate)),
        most_(static_cast<std::size_t>(options.trees.value_or(options.tolerance ? most_trees : 1))),
        threads_(std::clamp(options.threads / static_cast<int>(most_), 1, options.nodes_per_round)) {
    sets_[0].emplace(problem.captured, problem.scene);
    if (problem.succeeded) sets_[1].emplace(*problem.succeeded, problem.scene);
    if (problem.captured_any) sets_[2].emplace(*problem.captured_any, problem.scene);
    if (problem.succeeded_any) sets_[3].emplace(*problem.succeeded_any, problem.scene);
  }

  void grow() {
    const Limit enough = options_.limit.or_when(meets_tolerance_);
    parallel_for(most_, options_.threads, [&](std::size_t i) { grow_tree(i, enough); }, enough);
    if (trees_.count(0) == 0) grow_tree(0, enough);  // its root alone
  }

  CaptureScore score() {
    const std::size_t count = std::max<std::size_t>(counted_, 1);
    CaptureScore score;
    score.complete = options_.tolerance ? meets_tolerance_.load() : counted_ == most_;
    score.likelihoods = likelihoods(trees_.at(0).tree.costs, rate_);
    score.capture = *set_score(0, count);
    score.success = set_score(1, count);
    score.capture_any = set_score(2, count);
    score.success_any = set_score(3, count);
    for (std::size_t i = 0; i < count; ++i) {
      score.resolution += trees_.at(i).resolution / static_cast<double>(count);
      score.diverged += trees_.at(i).diverged;
      score += trees_.at(i).counts;
      score.trees.push_back(std::move(trees_.at(i).tree));
    }
    return score;
  }

 private:
  // Line 3 of Algorithm 2: EST(P_inf, M), a tree that has no goal; with a least likelihood EST(P_c, M), with c the cost
  // at which it is reached. The tree does not depend on the threads that make its rounds.
  void grow_tree(std::size_t index, const Limit& limit) {
    const std::uint64_t seed = stream(options_.seed, index);
    search::BoundedProblem bounded(problem_, nullptr, options_.nodes, seed, limit, Sampling::uniform, threads_);
    bounded.set_nodes_per_edge(options_.nodes_per_edge);
    bounded.count_in(options_.node_counter);
    if (options_.least_likelihood > 0.0) bounded.lower_bound(-portable::log(options_.least_likelihood) / rate_);
    search::Est est(bounded, stream(seed, search::streams::planner));
    est.set_nodes_per_round(options_.nodes_per_round);
    est.solve(bounded.termination());
    const bool complete = bounded.nodes_are_spent();
    if (!complete && index > 0) return;
    const StepCounts counts = bounded.counts(bounded.nodes());
    ScoredTree tree{bounded.take_tree(), counts, complete, bounded.diverged()};
    const Eigen::VectorXd weights = likelihoods(tree.tree.costs, rate_);
    tree.resolution = weights.maxCoeff();
    for (std::size_t set = 0; set < set_count; ++set) {
      if (sets_[set]) tree.likelihoods[set] = likelihood_inside(*sets_[set], tree.tree, weights);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    trees_.emplace(index, std::move(tree));
    count_trees();
  }

  void count_trees() {
    for (auto next = trees_.find(counted_); !meets_tolerance_ && next != trees_.end() && next->second.complete;
         next = trees_.find(counted_)) {
      ++counted_;
      if (options_.tolerance && counted_ >= fewest_trees) meets_tolerance_ = errors_are_at_most(*options_.tolerance);
    }
  }

  bool errors_are_at_most(double tolerance) const {
    for (std::size_t set = 0; set < set_count; ++set) {
      if (sets_[set] && !(standard_error(by_tree(set, counted_)) <= tolerance)) return false;
    }
    return true;
  }

  std::optional<SetScore> set_score(std::size_t set, std::size_t count) const {
    if (!sets_[set]) return std::nullopt;
    SetScore score;
    score.by_tree = by_tree(set, count);
    score.mean = score.by_tree.mean();
    if (count > 1) score.standard_error = standard_error(score.by_tree);
    return score;
  }

  // The likelihoods of the first `count` trees.
  Eigen::VectorXd by_tree(std::size_t set, std::size_t count) const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) values[static_cast<Eigen::Index>(i)] = trees_.at(i).likelihoods[set];
    return values;
  }

  const Problem& problem_;
  const CaptureOptions& options_;
  double rate_;
  std::size_t most_;
  int threads_;  // of a tree
  std::array<std::optional<Membership>, set_count> sets_;
  std::mutex mutex_;
  std::map<std::size_t, ScoredTree> trees_;
  std::size_t counted_ = 0;  // the first trees, which count
  std::atomic<bool> meets_tolerance_{false};
};

void validate(const CaptureOptions& options) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("nodes_per_edge", options.nodes_per_edge, 1);
  require_at_least("nodes_per_round", options.nodes_per_round, 1);
  require_least_likelihood(options.least_likelihood);
  if (options.tolerance) require_positive("tolerance", *options.tolerance);
  if (options.trees) {
    require_at_least(options.tolerance ? "trees with a tolerance" : "trees", *options.trees,
                     options.tolerance ? fewest_trees : 1);
  }
  require_at_least("threads", options.threads, 1);
  if (options.rate) require_not_negative("rate", *options.rate);
}

const SetScore& named_score(const CaptureScore& score, const std::string& which) {
  std::vector<std::string> names;
  for (const auto& [name, set] : set_scores(score)) {
    if (name == which && !set) reject("which", "'" + which + "'", "a set that the problem has");
    if (name == which) return *set;
    names.emplace_back(name);
  }
  reject("which", "'" + which + "'", alternatives(names));
}

// Nodes on the other side of a set come in clusters: one cluster weighs as much as so many heavy nodes.
constexpr double cluster = 2.0;

// Variance of the trees' scores in units of mean * (1 - mean), that of a share of single draws.
double dispersion(const Eigen::VectorXd& scores, double mean, double variance, double resolution) {
  const double single = mean * (1.0 - mean);
  const double measured = single > 0.0 ? variance / single : 0.0;
  const bool some_know_one_side = (scores.array() == 0.0 || scores.array() == 1.0).any();
  return some_know_one_side ? std::max(measured, cluster * resolution) : measured;
}

// Wilson's interval: the shares p with (mean - p)^2 <= width * p * (1 - p).
Interval share_interval(double mean, double width) {
  const double middle = mean + 0.5 * width;
  const double half = std::sqrt(width * (mean * (1.0 - mean) + 0.25 * width));
  return {(middle - half) / (1.0 + width), (middle + half) / (1.0 + width)};
}

}  // namespace

Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate) {
  const Eigen::ArrayXd above = costs.array() - costs.minCoeff();
  const Eigen::VectorXd weights = above.isFinite().select((-rate * above).exp(), 0.0);
  return weights / weights.sum();
}

std::array<std::pair<std::string_view, const SetScore*>, 4> set_scores(const CaptureScore& score) {
  const auto address = [](const std::optional<SetScore>& set) { return set ? &*set : nullptr; };
  return {{{"capture", &score.capture},
           {"success", address(score.success)},
           {"capture_any", address(score.capture_any)},
           {"success_any", address(score.success_any)}}};
}

void require_least_likelihood(double value) {
  if (!(value >= 0.0 && value < 1.0)) reject("least_likelihood", text(value), "at least 0 and below 1");
}

CaptureScore capture_score(const Problem& problem, const CaptureOptions& options) {
  validate(options);
  validate(problem);
  require_no_clock(problem, "capture_score");
  require_disturbed(problem, "capture_score");
  Forest forest(problem, options);
  forest.grow();
  CaptureScore score = forest.score();
  // A second of simulation is quick: a score that ran out of time is checked too.
  if (options.check_undisturbed && score.capture.mean > plausible::capture_score) {
    score.undisturbed_exit = undisturbed_exit(problem, options.limit.without_time());
  }
  score.warnings = implausible(score, problem);
  return score;
}

Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence) {
  if (!(confidence > 0.0 && confidence < 1.0)) reject("confidence", text(confidence), "a number between 0 and 1");
  if (scores.size() < 2) reject("trees", std::to_string(scores.size()), "two or more for an interval");
  const double n = static_cast<double>(scores.size());
  const double mean = scores.mean();
  const double variance = (scores.array() - mean).square().sum() / (n - 1.0);
  const double t = quantile(boost::math::students_t(n - 1.0), 0.5 + 0.5 * confidence);
  const Interval shares = share_interval(mean, dispersion(scores, mean, variance, resolution) * t * t / n);
  const double half = t * std::sqrt(variance / n);
  return {std::max(std::min(shares.low, mean - half), 0.0), std::min(std::max(shares.high, mean + half), 1.0)};
}

Interval interval(const CaptureScore& score, const std::string& which, double confidence) {
  return interval(named_score(score, which).by_tree, score.resolution, confidence);
}

}  // namespace energymargin

#include "metrics/searches.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "base/check.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/random.hpp"

namespace energymargin {
namespace {

struct EffortMetric {
  const char* name;
  const char* planner;
  Captured captured;
};

constexpr EffortMetric effort_metrics[] = {{"effort/est", "est", Captured::all},
                                           {"effort/rrt", "rrt", Captured::all},
                                           {"effort/est/any", "est", Captured::any},
                                           {"effort/rrt/any", "rrt", Captured::any}};
constexpr const char* tree_metrics[] = {"capture", "success", "capture/any", "success/any"};
constexpr const char* probability_metrics[] = {"probability", "probability/success", "probability/any"};
constexpr const char* force_metric = "force";

const EffortMetric* effort_metric(const std::string& name) {
  for (const EffortMetric& metric : effort_metrics) {
    if (metric.name == name) return &metric;
  }
  return nullptr;
}

template <typename Names>
bool has(const Names& names, const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

bool is_tree_metric(const std::string& name) { return has(tree_metrics, name); }

bool is_probability_metric(const std::string& name) { return has(probability_metrics, name); }

std::string known_metrics() {
  std::string names = std::string("'") + force_metric + "'";
  for (const char* name : tree_metrics) names += std::string(", '") + name + "'";
  for (const EffortMetric& metric : effort_metrics) names += std::string(", '") + metric.name + "'";
  for (const char* name : probability_metrics) names += std::string(", '") + name + "'";
  return names;
}

bool share_a_search(const std::string& metric, const std::string& other) {
  return metric == other || (is_tree_metric(metric) && is_tree_metric(other)) ||
         (is_probability_metric(metric) && is_probability_metric(other));
}

template <typename Result>
void add_quality(const Result& result, ScoreRow& row) {
  row += result;
  row.warnings.insert(row.warnings.end(), result.warnings.begin(), result.warnings.end());
}

void add_capture(const Problem& problem, const BatchOptions& options, std::uint64_t seed, ScoreRow& row) {
  CaptureOptions capture;
  capture.nodes = options.nodes;
  capture.nodes_per_edge = options.nodes_per_edge;
  capture.least_likelihood = options.least_likelihood;
  capture.seed = seed;
  capture.limit = options.limit;
  const CaptureScore score = capture_score(problem, capture);
  if (!score.complete) throw search::Stopped();
  add_quality(score, row);
  row.scores["capture"] = score.capture.mean;
  if (score.success) row.scores["success"] = score.success->mean;
  if (score.capture_any) row.scores["capture/any"] = score.capture_any->mean;
  if (score.success_any) row.scores["success/any"] = score.success_any->mean;
}

void add_effort(const Problem& problem, const EffortMetric& metric, const BatchOptions& options, std::uint64_t seed,
                ScoreRow& row) {
  EffortOptions effort;
  effort.planner = metric.planner;
  effort.nodes = options.nodes;
  effort.seed = seed;
  effort.captured = metric.captured;
  effort.limit = options.limit;
  effort.search = options.search;
  effort.stop_at_escape = options.stop_at_escape;
  const Escape escape = escape_effort(problem, effort);
  if (!escape.complete) throw search::Stopped();
  add_quality(escape, row);
  row.scores[metric.name] = escape.effort;
}

CaptureProbability complete_probability(const Problem& problem, const ProbabilityOptions& options) {
  try {
    CaptureProbability probability = capture_probability(problem, options);
    if (!probability.complete) throw search::Stopped();
    return probability;
  } catch (const Cancelled&) {
    throw search::Stopped();
  } catch (const TimedOut&) {
    throw search::Stopped();
  }
}

void add_survival(const char* metric, const Survival& survival, const Eigen::VectorXd& times, ScoreRow& row) {
  row.scores[metric] = survival.captured();
  row.curves[metric] = {times, survival.curve};
}

// Rollouts that go on for the other metrics have the bits of those that do not.
void add_probability(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options,
                     std::uint64_t seed, ScoreRow& row) {
  ProbabilityOptions probability;
  probability.disturbance = options.disturbance;
  probability.rollouts = options.rollouts;
  probability.seed = options.common_random_numbers ? options.seed : seed;
  probability.limit = options.limit;
  probability.undisturbed = false;
  probability.success = has(metrics, "probability/success");
  probability.by_object = has(metrics, "probability/any");
  const CaptureProbability p = complete_probability(problem, probability);
  add_quality(p, row);
  if (has(metrics, "probability")) add_survival("probability", p.all, p.times, row);
  if (p.any) add_survival("probability/any", *p.any, p.times, row);
  if (p.success) row.scores["probability/success"] = *p.success;
}

void add_scores(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options, ScoreRow& row) {
  const std::uint64_t seed = stream(options.seed, row.index);
  const std::string& first = metrics.front();
  if (is_tree_metric(first)) {
    add_capture(problem, options, seed, row);
  } else if (const EffortMetric* effort = effort_metric(first)) {
    add_effort(problem, *effort, options, seed, row);
  } else if (is_probability_metric(first)) {
    add_probability(problem, metrics, options, seed, row);
  } else {
    row.scores[force_metric] = force_score(problem).force;
  }
}

}  // namespace

void require_metrics(const std::vector<std::string>& metrics) {
  if (metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : metrics) {
    if (metric != force_metric && !is_tree_metric(metric) && !effort_metric(metric) && !is_probability_metric(metric)) {
      reject("metrics", "'" + metric + "'", "some of " + known_metrics());
    }
  }
}

std::vector<SearchMetrics> searches_for(const std::vector<std::string>& metrics) {
  std::vector<SearchMetrics> searches;
  for (const std::string& metric : metrics) {
    const auto shared = std::find_if(searches.begin(), searches.end(), [&](const SearchMetrics& search) {
      return share_a_search(search.front(), metric);
    });
    if (shared == searches.end()) {
      searches.push_back({metric});
    } else {
      shared->push_back(metric);
    }
  }
  return searches;
}

void run_search(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options, ScoreRow& row) {
  const auto start = Limit::Clock::now();
  add_scores(problem, metrics, options, row);
  const double seconds = std::chrono::duration<double>(Limit::Clock::now() - start).count();
  row.times[metrics.front()] = seconds;
  row.seconds += seconds;
}

}  // namespace energymargin

#include "metrics/searches.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "base/words.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/random.hpp"

namespace energymargin {
namespace {

enum class Kind { tree, effort, probability, force };

struct Metric {
  const char* name;
  Kind kind;
  const char* planner = "";  // of an effort, which has a search of its own; all others of a kind share one
  Captured captured = Captured::all;
};

constexpr Metric known_metrics[] = {{"force", Kind::force},
                                    {"capture", Kind::tree},
                                    {"success", Kind::tree},
                                    {"capture/any", Kind::tree},
                                    {"success/any", Kind::tree},
                                    {"effort/est", Kind::effort, "est"},
                                    {"effort/rrt", Kind::effort, "rrt"},
                                    {"effort/est/any", Kind::effort, "est", Captured::any},
                                    {"effort/rrt/any", Kind::effort, "rrt", Captured::any},
                                    {"probability", Kind::probability},
                                    {"probability/success", Kind::probability},
                                    {"probability/any", Kind::probability}};

const Metric* find_metric(const std::string& name) {
  const auto known = std::find_if(std::begin(known_metrics), std::end(known_metrics),
                                  [&](const Metric& metric) { return metric.name == name; });
  return known == std::end(known_metrics) ? nullptr : known;
}

bool share_a_search(const std::string& a, const std::string& b) {
  const Kind kind = find_metric(a)->kind;
  return a == b || (kind == find_metric(b)->kind && kind != Kind::effort);
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
  if (!score.complete) throw Cancelled();
  add_quality(score, row);
  row.scores["capture"] = score.capture.mean;
  if (score.success) row.scores["success"] = score.success->mean;
  if (score.capture_any) row.scores["capture/any"] = score.capture_any->mean;
  if (score.success_any) row.scores["success/any"] = score.success_any->mean;
}

void add_effort(const Problem& problem, const Metric& metric, const BatchOptions& options, std::uint64_t seed,
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
  if (!escape.complete) throw Cancelled();
  add_quality(escape, row);
  row.scores[metric.name] = escape.effort;
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
  const auto asked = [&](const char* name) { return std::find(metrics.begin(), metrics.end(), name) != metrics.end(); };
  probability.success = asked("probability/success");
  probability.by_object = asked("probability/any");
  const CaptureProbability p = capture_probability(problem, probability);
  if (!p.complete) throw Cancelled();
  add_quality(p, row);
  if (asked("probability")) add_survival("probability", p.all, p.times, row);
  if (p.any) add_survival("probability/any", *p.any, p.times, row);
  if (p.success) row.scores["probability/success"] = *p.success;
}

void add_scores(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options, ScoreRow& row) {
  const std::uint64_t seed = stream(options.seed, row.index);
  const Metric& first = *find_metric(metrics.front());
  switch (first.kind) {
    case Kind::tree:
      return add_capture(problem, options, seed, row);
    case Kind::effort:
      return add_effort(problem, first, options, seed, row);
    case Kind::probability:
      return add_probability(problem, metrics, options, seed, row);
    case Kind::force:
      row.scores["force"] = force_score(problem).force;
  }
}

}  // namespace

void require_metrics(const std::vector<std::string>& metrics) {
  if (metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : metrics) {
    if (find_metric(metric)) continue;
    std::vector<std::string> names;
    for (const Metric& known : known_metrics) names.emplace_back(known.name);
    reject("metrics", "'" + metric + "'", "some of " + alternatives(names, "'", ", "));
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

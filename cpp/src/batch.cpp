#include "energymargin/batch.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <iterator>
#include <mutex>
#include <thread>
#include <utility>

#include "check.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/random.hpp"

namespace energymargin {
namespace {

using Clock = std::chrono::steady_clock;

void add_capture(const Problem& problem, const BatchOptions& options, std::uint64_t seed, ScoreRow& row) {
  CaptureOptions capture;
  capture.nodes = options.nodes;
  capture.nodes_per_edge = options.nodes_per_edge;
  capture.least_likelihood = options.least_likelihood;
  capture.seed = seed;
  capture.limit = options.limit;
  const CaptureScore score = capture_score(problem, capture);
  if (!score.complete) throw search::Stopped();
  row.scores["capture"] = score.capture;
  if (score.success) row.scores["success"] = *score.success;
  if (score.capture_any) row.scores["capture/any"] = *score.capture_any;
  if (score.success_any) row.scores["success/any"] = *score.success_any;
}

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
constexpr const char* force_metric = "force";

const EffortMetric* effort_metric(const std::string& name) {
  for (const EffortMetric& metric : effort_metrics) {
    if (metric.name == name) return &metric;
  }
  return nullptr;
}

bool is_tree_metric(const std::string& name) {
  return std::find(std::begin(tree_metrics), std::end(tree_metrics), name) != std::end(tree_metrics);
}

std::string known_metrics() {
  std::string names = std::string("'") + force_metric + "'";
  for (const char* name : tree_metrics) names += std::string(", '") + name + "'";
  for (const EffortMetric& metric : effort_metrics) names += std::string(", '") + metric.name + "'";
  return names;
}

void validate(const BatchOptions& options, std::size_t problems) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("nodes_per_edge", options.nodes_per_edge, 1);
  require_least_likelihood(options.least_likelihood);
  require_at_least("threads", options.threads, 1);
  if (!options.indices.empty() && options.indices.size() != problems) {
    reject("indices", std::to_string(options.indices.size()) + " numbers", "one for each problem");
  }
  if (options.metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : options.metrics) {
    if (metric != force_metric && !is_tree_metric(metric) && !effort_metric(metric)) {
      reject("metrics", "'" + metric + "'", "some of " + known_metrics());
    }
  }
}

}  // namespace

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options) {
  const auto start = Clock::now();
  const std::uint64_t seed = stream(options.seed, index);
  ScoreRow row;
  row.index = index;
  bool tree_scored = false;
  for (const std::string& metric : options.metrics) {
    if (is_tree_metric(metric) && !std::exchange(tree_scored, true)) {
      add_capture(problem, options, seed, row);
    }
    if (const EffortMetric* effort = effort_metric(metric)) {
      // The search as published: of recorded states it tells better which are lost soon (docs/closed_forms.md).
      EffortOptions published = as_published({effort->planner, options.nodes, seed, effort->captured, options.limit});
      published.stop_at_escape = options.stop_at_escape;
      const Escape escape = escape_effort(problem, published);
      if (!escape.complete) throw search::Stopped();
      row.scores[metric] = escape.effort;
    }
    if (metric == force_metric) row.scores[metric] = force_score(problem).force;
  }
  row.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return row;
}

class Batch::Pool {
 public:
  Pool(std::vector<Problem> problems, BatchOptions options)
      : problems_(std::move(problems)), options_(std::move(options)) {
    options_.limit = options_.limit.or_when(stop_);
    const std::size_t threads = std::min(problems_.size(), static_cast<std::size_t>(options_.threads));
    working_ = static_cast<int>(threads);
    for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }

  ~Pool() { cancel(); }

  std::vector<ScoreRow> take(double timeout) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout), [this] { return !rows_.empty() || working_ == 0; });
    return std::exchange(rows_, {});
  }

  bool finished() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return working_ == 0 && rows_.empty();
  }

  void cancel() {
    stop_ = true;
    for (std::thread& thread : threads_) {
      if (thread.joinable()) thread.join();
    }
  }

 private:
  void work() {
    for (std::size_t i = next_++; i < problems_.size() && !options_.limit.reached(); i = next_++) {
      const std::size_t index = options_.indices.empty() ? i : options_.indices[i];
      ScoreRow row;
      try {
        row = score(problems_[i], index, options_);
      } catch (const search::Stopped&) {
        break;
      } catch (const std::exception& error) {
        row.index = index;
        row.error = error.what();
      }
      const std::lock_guard<std::mutex> lock(mutex_);
      rows_.push_back(std::move(row));
      changed_.notify_all();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  std::vector<Problem> problems_;
  BatchOptions options_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<ScoreRow> rows_;
  int working_ = 0;
  std::vector<std::thread> threads_;
};

Batch::Batch(std::vector<Problem> problems, const BatchOptions& options) {
  validate(options, problems.size());
  pool_ = std::make_unique<Pool>(std::move(problems), options);
}

Batch::~Batch() = default;

std::vector<ScoreRow> Batch::take(double timeout) { return pool_->take(timeout); }
bool Batch::finished() const { return pool_->finished(); }
void Batch::cancel() { pool_->cancel(); }

}  // namespace energymargin

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
#include "threads.hpp"

namespace energymargin {
namespace {

using Clock = std::chrono::steady_clock;

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

// The searches that the metrics need, each by one of its metrics: all that a tree gives come of the same one.
std::vector<std::string> searches_for(const std::vector<std::string>& metrics) {
  std::vector<std::string> searches;
  for (const std::string& metric : metrics) {
    const std::string search = is_tree_metric(metric) ? tree_metrics[0] : metric;
    if (std::find(searches.begin(), searches.end(), search) == searches.end()) searches.push_back(search);
  }
  return searches;
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
  row.scores["capture"] = score.capture;
  if (score.success) row.scores["success"] = *score.success;
  if (score.capture_any) row.scores["capture/any"] = *score.capture_any;
  if (score.success_any) row.scores["success/any"] = *score.success_any;
}

// The search as published: of recorded states it tells better which are lost soon (docs/closed_forms.md).
void add_effort(const Problem& problem, const EffortMetric& metric, const BatchOptions& options, std::uint64_t seed,
                ScoreRow& row) {
  EffortOptions published = as_published({metric.planner, options.nodes, seed, metric.captured, options.limit});
  published.stop_at_escape = options.stop_at_escape;
  const Escape escape = escape_effort(problem, published);
  if (!escape.complete) throw search::Stopped();
  row.scores[metric.name] = escape.effort;
}

// What one search gives, and how long it takes.
void add_search(const Problem& problem, const std::string& search, const BatchOptions& options, ScoreRow& row) {
  const auto start = Clock::now();
  const std::uint64_t seed = stream(options.seed, row.index);
  if (is_tree_metric(search)) {
    add_capture(problem, options, seed, row);
  } else if (const EffortMetric* effort = effort_metric(search)) {
    add_effort(problem, *effort, options, seed, row);
  } else {
    row.scores[force_metric] = force_score(problem).force;
  }
  row.seconds += std::chrono::duration<double>(Clock::now() - start).count();
}

// The row of a problem; its error is that of the first search that has one.
ScoreRow joined(const std::vector<ScoreRow>& parts) {
  ScoreRow row;
  row.index = parts.front().index;
  for (const ScoreRow& part : parts) {
    if (!part.error.empty()) return part;
    row.scores.insert(part.scores.begin(), part.scores.end());
    row.seconds += part.seconds;
  }
  return row;
}

}  // namespace

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options) {
  ScoreRow row;
  row.index = index;
  for (const std::string& search : searches_for(options.metrics)) add_search(problem, search, options, row);
  return row;
}

class Batch::Pool {
 public:
  Pool(std::vector<Problem> problems, BatchOptions options)
      : problems_(std::move(problems)), options_(std::move(options)), searches_(searches_for(options_.metrics)) {
    options_.limit = options_.limit.or_when(stop_);
    const std::size_t threads =
        std::min(problems_.size() * searches_.size(), static_cast<std::size_t>(options_.threads));
    working_ = with_threads ? static_cast<int>(threads) : 1;
    for (std::size_t i = 0; with_threads && i < threads; ++i) threads_.emplace_back([this] { work(); });
  }

  ~Pool() { cancel(); }

  std::vector<ScoreRow> take(double timeout) {
    if (!with_threads) work_for(timeout);
    const auto ready = [this] { return !rows_.empty() || working_ == 0; };
    std::unique_lock<std::mutex> lock(mutex_);
    if (with_threads) changed_.wait_for(lock, std::chrono::duration<double>(timeout), ready);
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
    while (take_on()) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  // Until there is a row, at least one search.
  void work_for(double timeout) {
    const auto end = Clock::now() + std::chrono::duration<double>(timeout);
    bool more = working_ > 0;
    while (more && rows_.empty()) {
      more = take_on();
      if (Clock::now() > end) break;
    }
    if (!more) working_ = 0;
  }

  // What is taken from the queue is one search of one problem: so a single problem keeps several threads busy, and so
  // does the end of a batch. False if there is none left, or the limit is reached.
  bool take_on() {
    const std::size_t next = next_++;
    const std::size_t problem = next / searches_.size();
    const std::size_t which = next % searches_.size();
    if (problem >= problems_.size() || options_.limit.reached()) return false;
    ScoreRow part;
    part.index = options_.indices.empty() ? problem : options_.indices[problem];
    try {
      add_search(problems_[problem], searches_[which], options_, part);
    } catch (const search::Stopped&) {
      return false;
    } catch (const std::exception& error) {
      part.error = error.what();
    }
    add(problem, which, std::move(part));
    return true;
  }

  void add(std::size_t problem, std::size_t which, ScoreRow part) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Unfinished& row = unfinished_[problem];
    row.parts.resize(searches_.size());
    row.parts[which] = std::move(part);
    if (++row.done < searches_.size()) return;
    rows_.push_back(joined(row.parts));
    unfinished_.erase(problem);
    changed_.notify_all();
  }

  struct Unfinished {
    std::vector<ScoreRow> parts;  // by search
    std::size_t done = 0;
  };

  std::vector<Problem> problems_;
  BatchOptions options_;
  std::vector<std::string> searches_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::size_t, Unfinished> unfinished_;  // by problem
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

#include "energymargin/batch.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iterator>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>

#include "base/check.hpp"
#include "base/threads.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/random.hpp"

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

constexpr const char* probability_metrics[] = {"probability", "probability/success", "probability/any"};
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

bool is_probability_metric(const std::string& name) {
  return std::find(std::begin(probability_metrics), std::end(probability_metrics), name) !=
         std::end(probability_metrics);
}

std::string known_metrics() {
  std::string names = std::string("'") + force_metric + "'";
  for (const char* name : tree_metrics) names += std::string(", '") + name + "'";
  for (const EffortMetric& metric : effort_metrics) names += std::string(", '") + metric.name + "'";
  for (const char* name : probability_metrics) names += std::string(", '") + name + "'";
  return names;
}

void require_metrics(const std::vector<std::string>& metrics) {
  if (metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : metrics) {
    if (metric != force_metric && !is_tree_metric(metric) && !effort_metric(metric) && !is_probability_metric(metric)) {
      reject("metrics", "'" + metric + "'", "some of " + known_metrics());
    }
  }
}

void validate(const BatchOptions& options) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("nodes_per_edge", options.nodes_per_edge, 1);
  require_least_likelihood(options.least_likelihood);
  require_at_least("rollouts", options.rollouts, 1);
  require_not_negative("strength", options.disturbance.strength);
  require_at_least("threads", options.threads, 1);
  require_metrics(options.metrics);
}

// Metrics that one search gives; its time is that of the first.
using Metrics = std::vector<std::string>;

bool of_one_search(const std::string& metric, const std::string& other) {
  return metric == other || (is_tree_metric(metric) && is_tree_metric(other)) ||
         (is_probability_metric(metric) && is_probability_metric(other));
}

// The searches that the metrics need: all that a tree gives come of the same one, and so do the probabilities.
std::vector<Metrics> searches_for(const Metrics& metrics) {
  std::vector<Metrics> searches;
  for (const std::string& metric : metrics) {
    const auto shared = std::find_if(searches.begin(), searches.end(),
                                     [&](const Metrics& search) { return of_one_search(search.front(), metric); });
    if (shared == searches.end()) {
      searches.push_back({metric});
    } else {
      shared->push_back(metric);
    }
  }
  return searches;
}

bool has(const Metrics& metrics, const char* name) {
  return std::find(metrics.begin(), metrics.end(), name) != metrics.end();
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

void add_effort(const Problem& problem, const EffortMetric& metric, const BatchOptions& options, std::uint64_t seed,
                ScoreRow& row) {
  EffortOptions effort{metric.planner, options.nodes, seed, metric.captured, options.limit, options.search};
  effort.stop_at_escape = options.stop_at_escape;
  const Escape escape = escape_effort(problem, effort);
  if (!escape.complete) throw search::Stopped();
  row.scores[metric.name] = escape.effort;
}

void add_survival(const char* metric, const Survival& survival, const Eigen::VectorXd& times, ScoreRow& row) {
  row.scores[metric] = survival.captured();
  row.curves[metric] = {times, survival.curve};
}

// Rollouts that run on for the other metrics have the bits of those that do not.
void add_probability(const Problem& problem, const Metrics& metrics, const BatchOptions& options, std::uint64_t seed,
                     ScoreRow& row) {
  ProbabilityOptions probability;
  probability.disturbance = options.disturbance;
  probability.rollouts = options.rollouts;
  probability.seed = options.common_random_numbers ? options.seed : seed;
  probability.limit = options.limit;
  probability.success = has(metrics, "probability/success");
  probability.by_object = has(metrics, "probability/any");
  const CaptureProbability found = [&] {
    try {
      return capture_probability(problem, probability);
    } catch (const Cancelled&) {
      throw search::Stopped();
    } catch (const TimedOut&) {
      throw search::Stopped();
    }
  }();
  if (!found.complete) throw search::Stopped();
  if (has(metrics, "probability")) add_survival("probability", found.all, found.times, row);
  if (found.any) add_survival("probability/any", *found.any, found.times, row);
  if (found.success) row.scores["probability/success"] = *found.success;
}

// What one search gives, and how long it takes.
void add_search(const Problem& problem, const Metrics& metrics, const BatchOptions& options, ScoreRow& row) {
  const auto start = Clock::now();
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
  row.times[first] = std::chrono::duration<double>(Clock::now() - start).count();
  row.seconds += row.times[first];
}

// The row of a problem; its error is that of the first search that has one.
ScoreRow joined(const std::vector<ScoreRow>& parts) {
  ScoreRow row;
  row.index = parts.front().index;
  for (const ScoreRow& part : parts) {
    if (!part.error.empty()) return part;
    row.scores.insert(part.scores.begin(), part.scores.end());
    row.times.insert(part.times.begin(), part.times.end());
    row.curves.insert(part.curves.begin(), part.curves.end());
    row.seconds += part.seconds;
  }
  return row;
}

}  // namespace

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options) {
  ScoreRow row;
  row.index = index;
  for (const Metrics& search : searches_for(options.metrics)) add_search(problem, search, options, row);
  return row;
}

class Batch::Pool {
 public:
  explicit Pool(BatchOptions options) : options_(std::move(options)) { options_.limit = options_.limit.or_when(stop_); }

  ~Pool() { cancel(); }

  void add(std::vector<Problem> problems, const std::vector<std::size_t>& indices,
           const std::vector<std::string>& metrics) {
    const std::vector<Metrics> searches = searches_for(metrics);
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < problems.size(); ++i) {
      queue_.push_back(std::make_shared<Work>(Work{std::move(problems[i]), indices[i], searches}));
    }
    pending_ += problems.size();
    if (with_threads) start_threads(running_ + queue_.size() * searches.size());
    changed_.notify_all();
  }

  std::size_t pending() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return pending_;
  }

  std::vector<ScoreRow> take(double timeout) {
    const std::optional<Clock::time_point> end = time_after(timeout);
    std::unique_lock<std::mutex> lock(mutex_);
    if (threads_.empty()) {
      lock.unlock();
      work_until(end);
      lock.lock();
    } else if (end) {
      changed_.wait_until(lock, *end, [this] { return row_or_over(); });
    } else {
      changed_.wait(lock, [this] { return row_or_over(); });
    }
    pending_ -= rows_.size();
    return std::exchange(rows_, {});
  }

  bool finished() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return over() && rows_.empty();
  }

  void cancel() {
    stop_ = true;
    end();
    for (std::thread& thread : threads_) {
      if (thread.joinable()) thread.join();
    }
  }

 private:
  // A problem whose row is not there yet.
  struct Work {
    Problem problem;
    std::size_t index;
    std::vector<Metrics> searches;
    std::vector<ScoreRow> parts{};  // one a search
    std::size_t started = 0;
    std::size_t done = 0;
  };

  // One search of one problem: what is taken from the queue, so that a single problem keeps several threads busy, and
  // so does the end of a batch.
  struct Search {
    std::shared_ptr<Work> work;
    std::size_t which;
  };

  // As many as there is work for. If the system gives none at all, `take` does the work.
  void start_threads(std::size_t searches) {
    const auto work = [this] {
      while (const auto search = next(true)) run(*search);
    };
    const std::size_t most = std::min(searches, static_cast<std::size_t>(options_.threads));
    while (!ended_ && threads_.size() < most && start_thread(threads_, work)) {
    }
  }

  // The next search, if need be once there is one; none if the batch has ended.
  std::optional<Search> next(bool wait) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (wait) changed_.wait(lock, [this] { return ended_ || !queue_.empty(); });
    if (ended_ || queue_.empty()) return std::nullopt;
    const std::shared_ptr<Work> work = queue_.front();
    const Search search{work, work->started++};
    work->parts.resize(work->searches.size());
    if (work->started == work->searches.size()) queue_.pop_front();
    ++running_;
    return search;
  }

  // Until there is a row, at least one search.
  void work_until(const std::optional<Clock::time_point>& end) {
    while (const auto search = next(false)) {
      run(*search);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!rows_.empty() || (end && Clock::now() > *end)) break;
    }
  }

  void run(const Search& search) {
    ScoreRow part;
    part.index = search.work->index;
    try {
      if (options_.limit.reached()) throw search::Stopped();
      add_search(search.work->problem, search.work->searches[search.which], options_, part);
    } catch (const search::Stopped&) {
      end(1);
      return;
    } catch (const std::exception& error) {
      part.error = error.what();
    }
    keep(search, std::move(part));
  }

  void keep(const Search& search, ScoreRow part) {
    const std::lock_guard<std::mutex> lock(mutex_);
    --running_;
    Work& work = *search.work;
    work.parts[search.which] = std::move(part);
    if (++work.done == work.searches.size()) rows_.push_back(joined(work.parts));
    changed_.notify_all();
  }

  // No more searches are begun; so many were running that do not any more.
  void end(std::size_t stopped = 0) {
    std::deque<std::shared_ptr<Work>> dropped;  // once unlocked: a problem may hold what takes another lock
    const std::lock_guard<std::mutex> lock(mutex_);
    running_ -= stopped;
    ended_ = true;
    dropped.swap(queue_);
    changed_.notify_all();
  }

  bool row_or_over() const { return !rows_.empty() || over(); }

  // No row will come any more.
  bool over() const { return running_ == 0 && (ended_ || pending_ == rows_.size()); }

  BatchOptions options_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Work>> queue_;
  std::vector<ScoreRow> rows_;
  std::size_t pending_ = 0;
  std::size_t running_ = 0;
  bool ended_ = false;
  std::vector<std::thread> threads_;
};

Batch::Batch(std::vector<Problem> problems, const BatchOptions& options) : Batch(options) {
  const std::vector<std::size_t>& given = options.indices;
  std::vector<std::size_t> counted(given.empty() ? problems.size() : 0);
  std::iota(counted.begin(), counted.end(), std::size_t{0});
  add(std::move(problems), given.empty() ? counted : given);
}

Batch::Batch(const BatchOptions& options) : metrics_(options.metrics) {
  validate(options);
  pool_ = std::make_unique<Pool>(options);
}

Batch::~Batch() = default;

void Batch::add(std::vector<Problem> problems, const std::vector<std::size_t>& indices,
                const std::vector<std::string>& metrics) {
  if (indices.size() != problems.size()) {
    reject("indices", std::to_string(indices.size()) + " numbers", "one for each problem");
  }
  if (!metrics.empty()) require_metrics(metrics);
  pool_->add(std::move(problems), indices, metrics.empty() ? metrics_ : metrics);
}

std::size_t Batch::pending() const { return pool_->pending(); }

std::vector<ScoreRow> Batch::take(double timeout) {
  if (!(timeout >= 0.0)) reject("timeout", text(timeout), "a number of seconds of at least 0; inf waits for a row");
  return pool_->take(timeout);
}

bool Batch::finished() const { return pool_->finished(); }
void Batch::cancel() { pool_->cancel(); }

}  // namespace energymargin

#include "energymargin/batch.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/check.hpp"
#include "base/thread_pool.hpp"
#include "base/words.hpp"
#include "energymargin/metrics/capture.hpp"
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
  Search search = Search::improved;
  Captured captured = Captured::all;
};

// Names of the metrics that one search gives.
using SearchMetrics = std::vector<std::string>;

constexpr Metric known_metrics[] = {{"force", Kind::force},
                                    {"capture", Kind::tree},
                                    {"success", Kind::tree},
                                    {"capture/any", Kind::tree},
                                    {"success/any", Kind::tree},
                                    {"effort", Kind::effort, "est"},
                                    {"effort/est", Kind::effort, "est", Search::published},
                                    {"effort/rrt", Kind::effort, "rrt", Search::published},
                                    {"effort/any", Kind::effort, "est", Search::improved, Captured::any},
                                    {"effort/est/any", Kind::effort, "est", Search::published, Captured::any},
                                    {"effort/rrt/any", Kind::effort, "rrt", Search::published, Captured::any},
                                    {"probability", Kind::probability},
                                    {"probability/success", Kind::probability},
                                    {"probability/any", Kind::probability}};

const Metric* find_metric(const std::string& name) {
  const auto known = std::find_if(std::begin(known_metrics), std::end(known_metrics),
                                  [&](const Metric& metric) { return metric.name == name; });
  return known == std::end(known_metrics) ? nullptr : known;
}

template <typename Result>
void add_quality(const Result& result, ScoreRow& row) {
  row += result;
  row.diverged += result.diverged;
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
  effort.search = metric.search;
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
  probability.most_diverged = options.most_diverged;
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

// Throws std::invalid_argument on an unknown metric, or none.
void require_metrics(const std::vector<std::string>& metrics) {
  if (metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : metrics) {
    if (find_metric(metric)) continue;
    std::vector<std::string> names;
    for (const Metric& known : known_metrics) names.emplace_back(known.name);
    reject("metrics", "'" + metric + "'", "some of " + alternatives(names, "'", ", "));
  }
}

// One search a tree, one for all probabilities, one an effort, and the force score.
std::vector<SearchMetrics> searches_for(const std::vector<std::string>& metrics) {
  std::vector<SearchMetrics> searches;
  for (const std::string& metric : metrics) {
    const Kind kind = find_metric(metric)->kind;
    const auto shared = std::find_if(searches.begin(), searches.end(), [&](const SearchMetrics& search) {
      return search.front() == metric || (find_metric(search.front())->kind == kind && kind != Kind::effort);
    });
    if (shared == searches.end()) {
      searches.push_back({metric});
    } else {
      shared->push_back(metric);
    }
  }
  return searches;
}

// Adds the scores of one search to the row of its problem, and its time at the first metric.
void run_search(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options, ScoreRow& row) {
  const auto start = Limit::Clock::now();
  const std::uint64_t seed = stream(options.seed, row.index);
  const Metric& first = *find_metric(metrics.front());
  if (first.kind == Kind::tree) add_capture(problem, options, seed, row);
  if (first.kind == Kind::effort) add_effort(problem, first, options, seed, row);
  if (first.kind == Kind::probability) add_probability(problem, metrics, options, seed, row);
  if (first.kind == Kind::force) row.scores["force"] = force_score(problem).force;
  const double seconds = std::chrono::duration<double>(Limit::Clock::now() - start).count();
  row.times[metrics.front()] = seconds;
  row.seconds += seconds;
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

// The row of a problem, from those of its searches; its error is that of the first search that has one.
ScoreRow merge(const std::vector<ScoreRow>& parts) {
  ScoreRow row;
  row.index = parts.front().index;
  for (const ScoreRow& part : parts) {
    if (!part.error.empty()) return part;
    row.scores.insert(part.scores.begin(), part.scores.end());
    row.times.insert(part.times.begin(), part.times.end());
    row.curves.insert(part.curves.begin(), part.curves.end());
    row.seconds += part.seconds;
    add_quality(part, row);
  }
  return row;
}

}  // namespace

struct Batch::Work {
  Problem problem;
  std::size_t index;
  std::vector<SearchMetrics> searches;
  std::vector<ScoreRow> parts{};  // one for each search
  std::size_t searches_done = 0;
};

Batch::Batch(std::vector<Problem> problems, const BatchOptions& options) : Batch(options) {
  std::vector<std::size_t> indices = options.indices;
  if (indices.empty()) {
    indices.resize(problems.size());
    std::iota(indices.begin(), indices.end(), std::size_t{0});
  }
  add(std::move(problems), indices);
}

Batch::Batch(const BatchOptions& options) : options_(options) {
  validate(options);
  options_.limit = options.limit.or_when(stop_);
}

void Batch::add(std::vector<Problem> problems, const std::vector<std::size_t>& indices,
                const std::vector<std::string>& metrics) {
  if (indices.size() != problems.size()) {
    reject("indices", std::to_string(indices.size()) + " numbers", "one for each problem");
  }
  if (!metrics.empty()) require_metrics(metrics);
  const std::vector<SearchMetrics> searches = searches_for(metrics.empty() ? options_.metrics : metrics);
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const auto work = std::make_shared<Work>(Work{std::move(problems[i]), indices[i], searches});
    for (std::size_t search = 0; search < searches.size(); ++search) queue_.push_back({work, search});
  }
  pending_ += problems.size();
  if (with_threads) start_threads();
  changed_.notify_all();
}

// As many threads as there are jobs. If the system gives none at all, `take` does the work.
void Batch::start_threads() {
  const auto work = [this] {
    while (const auto job = next(true)) run(*job);
  };
  const std::size_t most = std::min(running_ + queue_.size(), static_cast<std::size_t>(options_.threads));
  while (!ended_ && threads_.size() < most && start_thread(threads_, work)) {
  }
}

std::size_t Batch::pending() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return pending_;
}

std::vector<ScoreRow> Batch::take(double timeout) {
  if (!(timeout >= 0.0)) reject("timeout", text(timeout), "a number of seconds of at least 0; inf waits for a row");
  const std::optional<Limit::Clock::time_point> end = time_after(timeout);
  const auto row_or_over = [this] { return !rows_.empty() || over(); };
  std::unique_lock<std::mutex> lock(mutex_);
  if (threads_.empty()) {  // at least one job, and as many as a row needs
    do {
      lock.unlock();
      if (const auto job = next(false)) run(*job);
      lock.lock();
    } while (!queue_.empty() && rows_.empty() && !(end && Limit::Clock::now() > *end));
  } else if (end) {
    changed_.wait_until(lock, *end, row_or_over);
  } else {
    changed_.wait(lock, row_or_over);
  }
  pending_ -= rows_.size();
  return std::exchange(rows_, {});
}

bool Batch::finished() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return over() && rows_.empty();
}

void Batch::cancel() {
  stop_ = true;
  end();
  const std::lock_guard<std::mutex> lock(joining_);
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

// The next job; with `wait` the call waits for one. None if the batch has ended.
std::optional<Batch::Job> Batch::next(bool wait) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (wait) changed_.wait(lock, [this] { return ended_ || !queue_.empty(); });
  if (ended_ || queue_.empty()) return std::nullopt;
  Job job = std::move(queue_.front());
  queue_.pop_front();
  job.work->parts.resize(job.work->searches.size());
  ++running_;
  return job;
}

void Batch::run(const Job& job) {
  Work& work = *job.work;
  ScoreRow part;
  part.index = work.index;
  try {
    options_.limit.require();
    run_search(work.problem, work.searches[job.search], options_, part);
  } catch (const Cancelled&) {
    return end(1);
  } catch (const TimedOut&) {
    return end(1);
  } catch (const std::exception& error) {
    part.error = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  --running_;
  work.parts[job.search] = std::move(part);
  if (++work.searches_done == work.searches.size()) rows_.push_back(merge(work.parts));
  changed_.notify_all();
}

// No thread begins another job; `stopped` jobs have just ended without a result.
void Batch::end(std::size_t stopped) {
  std::deque<Job> dropped;  // freed after the lock: a problem's predicate may take another lock
  const std::lock_guard<std::mutex> lock(mutex_);
  running_ -= stopped;
  ended_ = true;
  dropped.swap(queue_);
  changed_.notify_all();
}

// No row will come any more.
bool Batch::over() const { return running_ == 0 && (ended_ || pending_ == rows_.size()); }

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options) {
  ScoreRow row;
  row.index = index;
  for (const SearchMetrics& search : searches_for(options.metrics)) run_search(problem, search, options, row);
  return row;
}

}  // namespace energymargin

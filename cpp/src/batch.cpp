#include "energymargin/batch.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "check.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/random.hpp"
#include "energymargin/search/bounded_problem.hpp"

namespace energymargin {
namespace {

using Clock = std::chrono::steady_clock;

void add_capture(const Problem& problem, const BatchOptions& options, std::uint64_t seed, const std::atomic<bool>* stop,
                 ScoreRow& row) {
  CaptureOptions capture;
  capture.nodes = options.nodes;
  capture.seed = seed;
  capture.stop = stop;
  const CaptureScore score = capture_score(problem, capture);
  row.scores["capture"] = score.capture;
  if (score.success) row.scores["success"] = *score.success;
}

void add_effort(const Problem& problem, const std::string& planner, const BatchOptions& options, std::uint64_t seed,
                const std::atomic<bool>* stop, ScoreRow& row) {
  row.scores["effort/" + planner] = escape_effort(problem, {planner, options.nodes, seed, stop}).effort;
}

void validate(const BatchOptions& options, std::size_t problems) {
  require_at_least("nodes", options.nodes, 1);
  require_at_least("threads", options.threads, 1);
  if (!options.indices.empty() && options.indices.size() != problems) {
    reject("indices", std::to_string(options.indices.size()) + " numbers", "one for each problem");
  }
  if (options.metrics.empty()) reject("metrics", "empty", "at least one metric");
  for (const std::string& metric : options.metrics) {
    if (metric != "capture" && metric != "success" && metric != "effort/est" && metric != "effort/rrt" &&
        metric != "force") {
      reject("metrics", "'" + metric + "'", "'capture', 'success', 'effort/est', 'effort/rrt' or 'force'");
    }
  }
}

}  // namespace

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options, const std::atomic<bool>* stop) {
  const auto start = Clock::now();
  const std::uint64_t seed = stream(options.seed, index);
  ScoreRow row;
  row.index = index;
  bool tree_scored = false;
  for (const std::string& metric : options.metrics) {
    if ((metric == "capture" || metric == "success") && !std::exchange(tree_scored, true)) {
      add_capture(problem, options, seed, stop, row);
    }
    if (metric == "effort/est") add_effort(problem, "est", options, seed, stop, row);
    if (metric == "effort/rrt") add_effort(problem, "rrt", options, seed, stop, row);
    if (metric == "force") row.scores["force"] = force_score(problem).force;
  }
  row.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return row;
}

class Batch::Pool {
 public:
  Pool(std::vector<Problem> problems, BatchOptions options)
      : problems_(std::move(problems)), options_(std::move(options)) {
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
    for (std::size_t i = next_++; i < problems_.size() && !stop_; i = next_++) {
      const std::size_t index = options_.indices.empty() ? i : options_.indices[i];
      ScoreRow row;
      try {
        row = score(problems_[i], index, options_, &stop_);
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

#include "energymargin/batch.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>

#include "base/check.hpp"
#include "base/threads.hpp"
#include "energymargin/metrics/capture.hpp"
#include "metrics/searches.hpp"

namespace energymargin {
namespace {

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
    row += part;
    row.warnings.insert(row.warnings.end(), part.warnings.begin(), part.warnings.end());
  }
  return row;
}

}  // namespace

class Batch::Pool {
 public:
  explicit Pool(BatchOptions options) : options_(std::move(options)) { options_.limit = options_.limit.or_when(stop_); }

  ~Pool() { cancel(); }

  void add(std::vector<Problem> problems, const std::vector<std::size_t>& indices,
           const std::vector<std::string>& metrics) {
    const std::vector<SearchMetrics> searches = searches_for(metrics);
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
    const std::optional<Limit::Clock::time_point> end = time_after(timeout);
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
    const std::lock_guard<std::mutex> lock(joining_);
    for (std::thread& thread : threads_) {
      if (thread.joinable()) thread.join();
    }
  }

 private:
  // A problem whose row is not complete.
  struct Work {
    Problem problem;
    std::size_t index;
    std::vector<SearchMetrics> searches;
    std::vector<ScoreRow> parts{};  // one for each search
    std::size_t searches_begun = 0;
    std::size_t searches_done = 0;
  };

  // One search of one problem. Threads take searches from the queue, so that a single problem, or the end of a batch,
  // keeps several of them busy.
  struct Search {
    std::shared_ptr<Work> work;
    std::size_t index;
  };

  // As many threads as there are searches. If the system gives none at all, `take` does the work.
  void start_threads(std::size_t searches) {
    const auto work = [this] {
      while (const auto search = next(true)) run(*search);
    };
    const std::size_t most = std::min(searches, static_cast<std::size_t>(options_.threads));
    while (!ended_ && threads_.size() < most && start_thread(threads_, work)) {
    }
  }

  // The next search; with `wait` the call waits for one. None if the batch has ended.
  std::optional<Search> next(bool wait) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (wait) changed_.wait(lock, [this] { return ended_ || !queue_.empty(); });
    if (ended_ || queue_.empty()) return std::nullopt;
    const std::shared_ptr<Work> work = queue_.front();
    const Search search{work, work->searches_begun++};
    work->parts.resize(work->searches.size());
    if (work->searches_begun == work->searches.size()) queue_.pop_front();
    ++running_;
    return search;
  }

  // At least one search, and as many as a row needs.
  void work_until(const std::optional<Limit::Clock::time_point>& end) {
    while (const auto search = next(false)) {
      run(*search);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!rows_.empty() || (end && Limit::Clock::now() > *end)) break;
    }
  }

  void run(const Search& search) {
    ScoreRow part;
    part.index = search.work->index;
    try {
      options_.limit.require();
      run_search(search.work->problem, search.work->searches[search.index], options_, part);
    } catch (const Cancelled&) {
      return end(1);
    } catch (const TimedOut&) {
      return end(1);
    } catch (const std::exception& error) {
      part.error = error.what();
    }
    store(search, std::move(part));
  }

  void store(const Search& search, ScoreRow part) {
    const std::lock_guard<std::mutex> lock(mutex_);
    --running_;
    Work& work = *search.work;
    work.parts[search.index] = std::move(part);
    if (++work.searches_done == work.searches.size()) rows_.push_back(merge(work.parts));
    changed_.notify_all();
  }

  // No thread begins another search; `stopped` searches have just ended without a result.
  void end(std::size_t stopped = 0) {
    std::deque<std::shared_ptr<Work>> dropped;  // freed after the lock: a problem's predicate may take another lock
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
  std::mutex joining_;  // of two that cancel at once, one joins the threads
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Work>> queue_;
  std::vector<ScoreRow> rows_;
  std::size_t pending_ = 0;
  std::size_t running_ = 0;
  bool ended_ = false;
  std::vector<std::thread> threads_;
};

Batch::Batch(std::vector<Problem> problems, const BatchOptions& options) : Batch(options) {
  std::vector<std::size_t> indices = options.indices;
  if (indices.empty()) {
    indices.resize(problems.size());
    std::iota(indices.begin(), indices.end(), std::size_t{0});
  }
  add(std::move(problems), indices);
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

ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options) {
  ScoreRow row;
  row.index = index;
  for (const SearchMetrics& search : searches_for(options.metrics)) run_search(problem, search, options, row);
  return row;
}

}  // namespace energymargin

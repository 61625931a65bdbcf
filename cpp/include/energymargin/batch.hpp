#pragma once
// Many problems on a pool of threads, one World each. The same bits for any number of threads.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "energymargin/disturbances.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! A probability over the horizon: of having been captured throughout until each time.
struct Curve {
  Eigen::VectorXd times;          //!< from 0 to the horizon, shape (T,) [s]
  Eigen::VectorXd probabilities;  //!< shape (T,)
};

//! The scores of one problem. Its steps are those of its searches.
struct ScoreRow : StepCounts {
  std::size_t index = 0;                 //!< the problem's stream index
  std::map<std::string, double> scores;  //!< by metric
  std::map<std::string, double>
      times;             //!< by metric: time of its search [s]; where several share it, at the first alone
  double seconds = 0.0;  //!< time of its searches on their threads, added up [s]
  std::string error;     //!< what went wrong, in the first search that fails; empty if all is well
  std::map<std::string, Curve> curves{};  //!< of "probability" and "probability/any", where they were asked for
  std::vector<Warning> warnings{};        //!< what speaks against its scores
  int diverged = 0;                       //!< rollouts of its searches that diverged
};

//! What to compute, and how.
struct BatchOptions {
  //! Of "capture", "success", "effort", "effort/est", "effort/rrt", "force" and, for several objects, with "/any" for
  //! those of at least one: all but "force/any". "effort" is the least work that is found, as of `escape_effort`;
  //! "effort/est" and "effort/rrt" are Algorithm 1 as published, with a horizon and without. Of problems with a horizon
  //! "probability", "probability/success" and "probability/any", under `disturbance`.
  std::vector<std::string> metrics{"capture", "success", "effort", "force"};
  int nodes = 1000;
  int nodes_per_edge = 1;         //!< of capture and success, as CaptureOptions
  double least_likelihood = 0.0;  //!< the same
  bool stop_at_escape = false;    //!< of the efforts, as EffortOptions
  int rollouts = 30;              //!< of the probabilities, as ProbabilityOptions
  double most_diverged = 0.01;    //!< the same
  std::uint64_t seed = 0;
  int threads = 1;
  disturbances::Uniform disturbance{};  //!< of the probabilities
  bool common_random_numbers = false;   //!< the probabilities of all problems draw from the seed itself
  //! Stream index of each problem, so that a run that goes on gives the same bits; empty: 0, 1, 2, ...
  std::vector<std::size_t> indices{};
  Limit limit{};  //!< ends the batch as `cancel` does
};

//! A running batch: threads take searches from one queue, to which problems can be added. A problem's row is there once
//! all its searches are done. If the system gives no thread at all, `take` does the work.
class Batch {
 public:
  //! Starts at once. Throws std::invalid_argument on bad options; a bad problem gives a row with an error.
  Batch(std::vector<Problem> problems, const BatchOptions& options);

  //! Starts without problems; `options.indices` are not asked for.
  explicit Batch(const BatchOptions& options);

  //! Cancels and joins.
  ~Batch() { cancel(); }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  //! Puts more problems at the end of the queue, with their stream indices, for these metrics (empty: those of the
  //! options). Throws std::invalid_argument as the constructor does, or if there is not an index for each problem.
  void add(std::vector<Problem> problems, const std::vector<std::size_t>& indices,
           const std::vector<std::string>& metrics = {});

  //! Problems that were added and whose rows are not taken yet.
  std::size_t pending() const;

  //! Rows finished since the last call; waits up to `timeout` [s], at least 0 or inf, for the first of them.
  std::vector<ScoreRow> take(double timeout);

  //! All rows are computed, or the batch has ended before, and all are taken.
  bool finished() const;

  //! Stops within one rollout and joins the threads; unfinished problems give no row.
  void cancel();

 private:
  struct Work;  // a problem whose row is not complete

  // One search of a problem: so a single problem, or the end of a batch, keeps several threads busy.
  struct Job {
    std::shared_ptr<Work> work;
    std::size_t search;
  };

  void start_threads();
  std::optional<Job> next(bool wait);
  void run(const Job& job);
  void end(std::size_t stopped = 0);
  bool over() const;

  BatchOptions options_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::mutex joining_;  // of two that cancel at once, one joins the threads
  std::condition_variable changed_;
  std::deque<Job> queue_;
  std::vector<ScoreRow> rows_;
  std::size_t pending_ = 0;  // problems
  std::size_t running_ = 0;  // jobs
  bool ended_ = false;
  std::vector<std::thread> threads_;
};

//! Scores one problem on the calling thread. Throws Cancelled or TimedOut if it reaches the limit.
ScoreRow score(const Problem& problem, std::size_t index, const BatchOptions& options);

}  // namespace energymargin

#include "energymargin/metrics/effort.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/random.hpp"
#include "metrics/words.hpp"
#include "search/planners.hpp"
#include "search/shortening.hpp"

namespace energymargin {
namespace {

constexpr int nodes_of_simulator = 16;  // of a round, which it plays together

// Algorithm 1: AO-x over EST or RRT.
Escape find_escape(const Problem& problem, const EffortOptions& options, search::Confirm confirm) {
  const bool improved = options.search == Search::improved;
  const Sampling sampling = options.sampling.value_or(improved ? Sampling::mixed : Sampling::uniform);
  search::BoundedProblem bounded(problem, &capture_set(problem, options.captured), options.nodes, options.seed,
                                 options.limit, sampling, std::min(options.threads, options.nodes_per_round));
  bounded.count_in(options.node_counter);
  if (options.stop_at_escape) bounded.stop_at_escape();
  std::unique_ptr<search::Shortening> shortening;
  if (options.shorten.value_or(improved)) {
    shortening =
        std::make_unique<search::Shortening>(problem, bounded, stream(options.seed, search::streams::shortening));
  }
  if (shortening) shortening->set_attempts_per_round(options.nodes_per_round);
  const auto search = [&](auto&& planner, int nodes_per_round) {
    planner.set_nodes_per_round(nodes_per_round);
    return ao(bounded, planner, shortening.get(), confirm);
  };
  const int together = problem.scene.stepping().simulator ? nodes_of_simulator : 1;
  if (options.planner == "rrt") return search(search::Rrt(bounded), options.nodes_per_round);
  return search(search::Est(bounded, stream(options.seed, search::streams::planner)),
                std::max(options.nodes_per_round, together));
}

// Nearly all best escapes are confirmed, and then the last one says as much as all of them.
Escape find_escape(const Problem& problem, const EffortOptions& options) {
  Escape escape = find_escape(problem, options, search::Confirm::best);
  if (escape.discarded == 0) return escape;
  if (options.node_counter) *options.node_counter -= escape.nodes();
  Escape again = find_escape(problem, options, search::Confirm::each_turn);
  if (again.complete || again.effort < escape.effort) return again;
  if (options.node_counter) *options.node_counter += escape.nodes() - again.nodes();
  escape.complete = false;
  return escape;
}

// Independent searches by their number. The first of those of least effort is kept, of the others what they counted.
class BestEscape {
 public:
  void add(std::size_t number, Escape escape) {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts_[number] = {escape, escape.discarded, escape.discarded_effort, escape.diverged};
    all_complete_ = all_complete_ && escape.complete;
    const bool is_better = !best_ || escape.effort < best_->effort || (escape.effort == best_->effort && number < of_);
    if (!is_better) return;
    best_ = std::move(escape);
    of_ = number;
  }

  bool has_first() const { return counts_.count(0) > 0; }

  //! The best one, with what all of `searches` counted. A search that has not begun by the limit has none.
  Escape escape(std::size_t searches) {
    Escape best = std::move(*best_);
    best.complete = (all_complete_ && counts_.size() == searches) || best.effort == 0.0;
    for (const auto& [number, counts] : counts_) {
      if (number == of_) continue;
      best += counts;
      best.discarded += counts.discarded;
      best.discarded_effort = std::min(best.discarded_effort, counts.discarded_effort);
      best.diverged += counts.diverged;
    }
    return best;
  }

 private:
  struct Counts : StepCounts {
    int discarded = 0;
    double discarded_effort = std::numeric_limits<double>::infinity();
    int diverged = 0;
  };

  std::mutex mutex_;
  std::optional<Escape> best_;
  std::size_t of_ = 0;  // the number of the best one
  std::map<std::size_t, Counts> counts_;
  bool all_complete_ = true;
};

Escape find_escapes(const Problem& problem, const EffortOptions& options) {
  if (options.searches == 1) return find_escape(problem, options);
  BestEscape best;
  const auto search = [&](std::size_t i) {
    EffortOptions one = options;
    const auto more = static_cast<std::size_t>(options.nodes % options.searches);  // the first have one more
    one.nodes = options.nodes / options.searches + (i < more ? 1 : 0);
    one.seed = stream(options.seed, i);
    one.threads = 1;
    best.add(i, find_escape(problem, one));
  };
  const auto searches = static_cast<std::size_t>(options.searches);
  parallel_for(searches, options.threads, search, options.limit);
  if (!best.has_first()) search(0);  // its root alone
  return best.escape(searches);
}

}  // namespace

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  require_word("planner", options.planner, effort_planners);
  require_at_least("nodes", options.nodes, 1);
  require_at_least("threads", options.threads, 1);
  require_at_least("searches", options.searches, 1);
  require_at_least("nodes_per_round", options.nodes_per_round, 1);
  if (options.searches > options.nodes) {
    reject("searches", std::to_string(options.searches), "at most `nodes`, " + std::to_string(options.nodes));
  }
  validate(problem);
  require_disturbed(problem, "escape_effort");
  Escape escape = find_escapes(problem, options);
  if (options.check_undisturbed && escape.effort > 0.0 && !escape.undisturbed_exit && !timing_of(problem)) {
    Problem future = problem;
    future.captured = capture_set(problem, options.captured);
    escape.undisturbed_exit = undisturbed_exit(future, options.limit.without_time());
  }
  escape.warnings = implausible(escape, problem);
  return escape;
}

}  // namespace energymargin

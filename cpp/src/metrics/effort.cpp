#include "energymargin/metrics/effort.hpp"

#include <memory>

#include "base/check.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/random.hpp"
#include "metrics/words.hpp"
#include "search/planners.hpp"
#include "search/shortening.hpp"

namespace energymargin {
namespace {

// Algorithm 1: AO-x over EST or RRT.
Escape find_escape(const Problem& problem, const EffortOptions& options, search::Confirm confirm) {
  const bool improved = options.search.value_or(search_of(problem)) == Search::improved;
  const Sampling sampling = options.sampling.value_or(improved ? Sampling::mixed : Sampling::uniform);
  search::BoundedProblem bounded(problem, &capture_set(problem, options.captured), options.nodes, options.seed,
                                 options.limit, sampling);
  bounded.count_in(options.node_counter);
  if (options.stop_at_escape) bounded.stop_at_escape();
  std::unique_ptr<search::Shortening> shortening;
  if (options.shorten.value_or(improved)) {
    shortening =
        std::make_unique<search::Shortening>(problem, bounded, stream(options.seed, search::streams::shortening));
  }
  if (options.planner == "est") {
    search::Est est(bounded, stream(options.seed, search::streams::planner));
    return ao(bounded, est, shortening.get(), confirm);
  }
  search::Rrt rrt(bounded);
  return ao(bounded, rrt, shortening.get(), confirm);
}

}  // namespace

Search search_of(const Problem& problem) { return timing_of(problem) ? Search::improved : Search::published; }

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  require_word("planner", options.planner, effort_planners);
  require_at_least("nodes", options.nodes, 1);
  validate(problem);
  // Nearly all best escapes are confirmed, and then the last one says as much as all of them.
  Escape escape = find_escape(problem, options, search::Confirm::best);
  if (escape.discarded > 0) {
    if (options.node_counter) *options.node_counter = 0;
    escape = find_escape(problem, options, search::Confirm::each_turn);
  }
  if (options.check_undisturbed && escape.effort > 0.0 && !escape.undisturbed_exit && !timing_of(problem)) {
    Problem future = problem;
    future.captured = capture_set(problem, options.captured);
    escape.undisturbed_exit = undisturbed_exit(future, options.limit.without_time());
  }
  escape.warnings = implausible(escape, problem);
  return escape;
}

}  // namespace energymargin

#include "energymargin/metrics/effort.hpp"

#include <stdexcept>

#include "base/check.hpp"
#include "energymargin/random.hpp"
#include "energymargin/search/ao.hpp"
#include "metrics/words.hpp"
#include "search/est.hpp"
#include "search/rrt.hpp"

namespace energymargin {
namespace {

// Streams of the call's seed; BoundedProblem has 1 and 2.
constexpr std::uint64_t planner_stream = 0;
constexpr std::uint64_t shortening_stream = 3;

Escape search_for_escape(const Problem& problem, const EffortOptions& options, search::Confirm confirm) {
  const bool improved = options.search == Search::improved;
  const Sampling sampling = options.sampling.value_or(improved ? Sampling::mixed : Sampling::uniform);
  search::BoundedProblem bounded(problem, &capture_set(problem, options.captured), options.nodes, options.seed,
                                 options.limit, sampling);
  bounded.count_in(options.node_counter);
  if (options.stop_at_escape) bounded.stop_at_escape();
  search::Shortening shortening(bounded, search::largest_edge(problem), stream(options.seed, shortening_stream));
  search::Shortening* const polish = options.shorten.value_or(improved) ? &shortening : nullptr;
  const std::uint64_t planner_seed = stream(options.seed, planner_stream);
  if (options.planner == "est") {
    search::Est est(bounded, planner_seed);
    return search::ao(bounded, est, polish, confirm);
  }
  search::Rrt rrt(bounded, planner_seed);
  return search::ao(bounded, rrt, polish, confirm);
}

}  // namespace

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  require_word("planner", options.planner, effort_planners);
  require_at_least("nodes", options.nodes, 1);
  validate(problem);
  // Nearly all best escapes are confirmed, and then the last one says as much as all of them.
  Escape escape = search_for_escape(problem, options, search::Confirm::best);
  if (escape.discarded == 0) return escape;
  if (options.node_counter) *options.node_counter = 0;
  return search_for_escape(problem, options, search::Confirm::each_turn);
}

}  // namespace energymargin

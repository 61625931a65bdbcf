#include "search/escape_search.hpp"

#include <optional>

#include "energymargin/random.hpp"
#include "search/ao_with_shortening.hpp"
#include "search/est.hpp"
#include "search/rrt.hpp"
#include "search/streams.hpp"

namespace energymargin::search {
namespace {

Escape run(const Problem& problem, const Region& captured, const EscapeSearchOptions& options, Confirm confirm) {
  BoundedProblem bounded(problem, &captured, options.nodes, options.seed, options.limit, options.sampling);
  bounded.count_in(options.node_counter);
  if (options.stop_at_escape) bounded.stop_at_escape();
  std::optional<Shortening> shortening;
  if (options.shorten) shortening.emplace(problem, bounded, stream(options.seed, streams::shortening));
  Shortening* const turns = shortening ? &*shortening : nullptr;
  if (options.planner == FeasiblePlanner::est) {
    Est est(bounded, stream(options.seed, streams::planner));
    return ao(bounded, est, turns, confirm);
  }
  Rrt rrt(bounded);
  return ao(bounded, rrt, turns, confirm);
}

}  // namespace

// Nearly all best escapes are confirmed, and then the last one says as much as all of them.
Escape find_escape(const Problem& problem, const Region& captured, const EscapeSearchOptions& options) {
  Escape escape = run(problem, captured, options, Confirm::best);
  if (escape.discarded == 0) return escape;
  if (options.node_counter) *options.node_counter = 0;
  return run(problem, captured, options, Confirm::each_turn);
}

}  // namespace energymargin::search

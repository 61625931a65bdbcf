#include "energymargin/metrics/effort.hpp"

#include "base/check.hpp"
#include "energymargin/metrics/guards.hpp"
#include "metrics/words.hpp"
#include "search/escape_search.hpp"

namespace energymargin {
namespace {

search::EscapeSearchOptions search_options(const Problem& problem, const EffortOptions& options) {
  const bool improved = options.search.value_or(search_of(problem)) == Search::improved;
  search::EscapeSearchOptions result;
  result.planner = options.planner == "est" ? search::FeasiblePlanner::est : search::FeasiblePlanner::rrt;
  result.nodes = options.nodes;
  result.seed = options.seed;
  result.limit = options.limit;
  result.sampling = options.sampling.value_or(improved ? Sampling::mixed : Sampling::uniform);
  result.shorten = options.shorten.value_or(improved);
  result.stop_at_escape = options.stop_at_escape;
  result.node_counter = options.node_counter;
  return result;
}

}  // namespace

Search search_of(const Problem& problem) { return timing_of(problem) ? Search::improved : Search::published; }

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  require_word("planner", options.planner, effort_planners);
  require_at_least("nodes", options.nodes, 1);
  validate(problem);
  Escape escape =
      search::find_escape(problem, capture_set(problem, options.captured), search_options(problem, options));
  escape.warnings = implausible(escape, problem);
  return escape;
}

}  // namespace energymargin

#include "energymargin/metrics/effort.hpp"

#include <stdexcept>

#include "../check.hpp"
#include "energymargin/random.hpp"
#include "energymargin/search/ao.hpp"
#include "energymargin/search/est.hpp"
#include "energymargin/search/rrt.hpp"

namespace energymargin {

Escape escape_effort(const Problem& problem, const EffortOptions& options) {
  if (options.planner != "est" && options.planner != "rrt") {
    reject("planner", "'" + options.planner + "'", "'est' or 'rrt'");
  }
  require_at_least("nodes", options.nodes, 1);
  validate(problem);
  search::BoundedProblem bounded(problem, &capture_set(problem, options.captured), options.nodes, options.seed,
                                 options.limit);
  const std::uint64_t planner_seed = stream(options.seed, 0);
  if (options.planner == "est") {
    search::Est est(bounded, planner_seed);
    return search::ao(bounded, est);
  }
  search::Rrt rrt(bounded, planner_seed);
  return search::ao(bounded, rrt);
}

}  // namespace energymargin

#include "search/exploration.hpp"

#include "energymargin/random.hpp"
#include "search/est.hpp"
#include "search/streams.hpp"

namespace energymargin::search {

Exploration explore(const Problem& problem, const ExplorationOptions& options) {
  BoundedProblem bounded(problem, nullptr, options.nodes, options.seed, options.limit, Sampling::uniform,
                         options.threads);
  bounded.set_nodes_per_edge(options.nodes_per_edge);
  bounded.count_in(options.node_counter);
  bounded.lower_bound(options.bound);
  Est est(bounded, stream(options.seed, streams::planner));
  est.set_nodes_per_round(options.nodes_per_round);
  est.solve(bounded.termination());
  const bool complete = bounded.nodes_are_spent();
  const int diverged = bounded.diverged();
  const StepCounts counts = bounded.counts(bounded.nodes());
  return {bounded.take_tree(), complete, diverged, counts};
}

}  // namespace energymargin::search

#include "energymargin/search/ao.hpp"

#include <ompl/control/PathControl.h>

#include <limits>

#include "energymargin/search/prunable.hpp"

namespace energymargin::search {
namespace {

// The node in which the planner's solution ends.
const CostSpace::StateType& solution(const ompl::base::ProblemDefinition& definition) {
  return *definition.getSolutionPath()
              ->as<ompl::control::PathControl>()
              ->getStates()
              .back()
              ->as<CostSpace::StateType>();
}

}  // namespace

Escape ao(BoundedProblem& problem, ompl::base::Planner& planner) {
  Escape escape;
  escape.effort = std::numeric_limits<double>::infinity();
  int last = -1;
  const ompl::base::ProblemDefinitionPtr& definition = problem.definition();
  if (definition->getGoal()->isSatisfied(definition->getStartState(0))) {
    last = 0;
    escape.effort = 0.0;
    escape.history.emplace_back(0, 0.0);
  }
  while (!problem.spent() && escape.effort > 0.0) {
    planner.solve(problem.termination());
    if (!definition->hasExactSolution()) break;
    const CostSpace::StateType& end = solution(*definition);
    last = end.node;
    escape.effort = end.cost;
    escape.history.emplace_back(problem.nodes(), escape.effort);
    problem.lower_bound(escape.effort);
    definition->clearSolutionPaths();
    if (auto* prunable = dynamic_cast<Prunable*>(&planner)) prunable->prune(escape.effort);
  }
  escape.complete = problem.nodes_are_spent() || escape.effort == 0.0;
  escape.tree = problem.take_tree();
  escape.path = escape.tree.path_to(last);
  return escape;
}

}  // namespace energymargin::search

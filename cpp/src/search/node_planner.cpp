#include "search/node_planner.hpp"

#include <ompl/control/PathControl.h>

#include "search/wrench_space.hpp"

namespace energymargin::search {

NodePlanner::NodePlanner(BoundedProblem& problem, const char* name)
    : Planner(problem.space_information(), name),
      problem_(problem),
      sampler_(problem.space_information()->allocControlSampler()) {
  state_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
  setProblemDefinition(problem.definition());
}

ompl::base::PlannerStatus NodePlanner::solve(const ompl::base::PlannerTerminationCondition& ptc) {
  checkValidity();
  while (const ompl::base::State* start = pis_.nextStart()) add(node_of(start));
  if (empty()) return ompl::base::PlannerStatus::INVALID_START;
  int solution = -1;
  while (solution < 0 && !ptc) {
    for (const int node : problem_.extend(draw_round())) {
      if (!problem_.allowed(node)) continue;
      add(node);
      if (solution < 0 && problem_.escaped(node)) solution = node;
    }
  }
  if (solution < 0) return ompl::base::PlannerStatus::TIMEOUT;
  solved_by(solution);
  return ompl::base::PlannerStatus::EXACT_SOLUTION;
}

EdgeFrom NodePlanner::draw_edge(int node) {
  const auto* controls = problem_.space_information()->getControlSpace()->as<WrenchSpace>();
  Eigen::VectorXd before(controls->getDimension()), values(controls->getDimension());
  before << problem_.edge(node).wrenches, 0.0;
  WrenchSpace::ControlType last, next;
  last.values = before.data();
  next.values = values.data();
  sampler_->sampleNext(&next, &last, &described(node));
  sampler_->sampleStepCount(1, 1);  // OMPL's planners draw that too, from the same stream
  return {node, controls->edge(&next)};
}

const CostSpace::StateType& NodePlanner::described(int node) {
  problem_.describe(node, &state_);
  return state_;
}

void NodePlanner::solved_by(int node) {
  const auto path = std::make_shared<ompl::control::PathControl>(si_);
  path->append(&described(node));
  pdef_->addSolutionPath(path, false, 0.0, getName());
}

}  // namespace energymargin::search

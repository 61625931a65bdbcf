#include "search/est.hpp"

#include <ompl/control/PathControl.h>

#include <algorithm>

#include "search/wrench_space.hpp"

namespace energymargin::search {

Est::Est(BoundedProblem& problem, std::uint64_t seed)
    : Planner(problem.space_information(), "EST"),
      problem_(problem),
      sampler_(problem.space_information()->allocControlSampler()),
      projection_(si_->getStateSpace()->getDefaultProjection()) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  state_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
  setProblemDefinition(problem.definition());
  setup();
}

ompl::base::PlannerStatus Est::solve(const ompl::base::PlannerTerminationCondition& ptc) {
  checkValidity();
  while (const ompl::base::State* start = pis_.nextStart()) add(node_of(start));
  if (grid_.empty()) return ompl::base::PlannerStatus::INVALID_START;
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

void Est::clear() {
  Planner::clear();
  grid_ = {};
}

void Est::prune(double bound) {
  const std::vector<int> nodes = grid_.nodes();
  grid_ = {};
  for (const int node : nodes) {
    if (problem_.worth_keeping(node, bound)) add(node);
  }
}

void Est::add(int node) {
  Eigen::VectorXi cell(projection_->getDimension());
  problem_.describe(node, &state_);
  projection_->computeCoordinates(&state_, cell);
  grid_.add(node, cell);
}

std::vector<EdgeFrom> Est::draw_round() {
  // A first round of many edges from the root alone would make the tree shallow.
  const int nodes = problem_.nodes() + 1;
  const int count = std::min({nodes_per_round_, nodes, std::max(problem_.rollouts_left(), 1)});
  std::vector<EdgeFrom> round;
  for (int i = 0; i < count; ++i) {
    const int node = grid_.draw(rng_);
    round.push_back({node, draw_edge(node)});
  }
  return round;
}

Edge Est::draw_edge(int node) {
  const auto* controls = problem_.space_information()->getControlSpace()->as<WrenchSpace>();
  Eigen::VectorXd before(controls->getDimension()), values(controls->getDimension());
  before << problem_.edge(node).wrenches, 0.0;
  WrenchSpace::ControlType last, next;
  last.values = before.data();
  next.values = values.data();
  problem_.describe(node, &state_);
  sampler_->sampleNext(&next, &last, &state_);
  sampler_->sampleStepCount(1, 1);  // OMPL's planners draw that too, from the same stream
  return controls->edge(&next);
}

void Est::solved_by(int node) {
  const auto path = std::make_shared<ompl::control::PathControl>(si_);
  problem_.describe(node, &state_);
  path->append(&state_);
  pdef_->addSolutionPath(path, false, 0.0, getName());
}

}  // namespace energymargin::search

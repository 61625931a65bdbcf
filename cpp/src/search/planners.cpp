#include "search/planners.hpp"

#include <ompl/control/PathControl.h>

#include <algorithm>

#include "search/wrench_space.hpp"

namespace energymargin::search {
namespace {

constexpr int sampled = -1;  // as a node

constexpr double rounding = 1e-12;  // of distances

}  // namespace

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
  const auto path = std::make_shared<ompl::control::PathControl>(si_);
  path->append(&described(solution));
  pdef_->addSolutionPath(path, false, 0.0, getName());
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

Est::Est(BoundedProblem& problem, std::uint64_t seed)
    : NodePlanner(problem, "EST"), projection_(si_->getStateSpace()->getDefaultProjection()) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
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
  projection_->computeCoordinates(&described(node), cell);
  grid_.add(node, cell);
}

std::vector<EdgeFrom> Est::draw_round() {
  // A first round of many edges from the root alone would make the tree shallow.
  const int nodes = problem_.nodes() + 1;
  const int count = std::min({nodes_per_round_, nodes, std::max(problem_.rollouts_left(), 1)});
  std::vector<EdgeFrom> round;
  for (int i = 0; i < count; ++i) round.push_back(draw_edge(grid_.draw(rng_)));
  return round;
}

Rrt::Rrt(BoundedProblem& problem) : NodePlanner(problem, "RRT"), state_sampler_(si_->allocStateSampler()) {
  sample_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
  nodes_.setDistanceFunction([this](int a, int b) { return si_->distance(state(a), state(b)); });
}

void Rrt::prune(double bound) {
  const auto stays = [&](int node) {
    while (node >= 0 && problem_.worth_keeping(node, bound)) node = problem_.parent(node);
    return node < 0;
  };
  std::vector<int> nodes;
  nodes_.list(nodes);
  nodes_.clear();
  for (const int node : nodes) {
    if (stays(node)) {
      nodes_.add(node);
    } else {
      states_[static_cast<std::size_t>(node)].reset();
    }
  }
}

void Rrt::add(int node) {
  states_.resize(std::max(states_.size(), static_cast<std::size_t>(node) + 1));
  auto& state = states_[static_cast<std::size_t>(node)] = std::make_unique<CostSpace::StateType>();
  static_cast<CostSpace::Values&>(*state) = described(node);
  nodes_.add(node);
}

std::vector<EdgeFrom> Rrt::draw_round() {
  state_sampler_->sampleUniform(&sample_);
  return {draw_edge(nearest_to_sample())};
}

// The first one of equally near nodes. Which of them OMPL's structure finds depends on pivots that it draws from a
// global seed, and rollouts that leave the object where it is make many such ties.
int Rrt::nearest_to_sample() const {
  const int any = nodes_.nearest(sampled);
  std::vector<int> ties;
  nodes_.nearestR(sampled, si_->distance(&sample_, state(any)) * (1.0 + rounding) + rounding, ties);
  ties.push_back(any);
  return *std::min_element(ties.begin(), ties.end());
}

const ompl::base::State* Rrt::state(int node) const {
  return node == sampled ? &sample_ : states_[static_cast<std::size_t>(node)].get();
}

}  // namespace energymargin::search

#include "search/planners.hpp"

#include <ompl/control/PathControl.h>

#include <algorithm>

#include "energymargin/random.hpp"
#include "search/wrench_space.hpp"

namespace energymargin::search {
namespace {

constexpr int sampled = -1;  // as a node

constexpr double rounding = 1e-12;  // of distances

// How many weights are in the i-th sum.
std::size_t width(std::size_t i) { return i & (~i + 1); }

// A hash. Of a million cells two have the same with a chance of 3e-8, and then count as one.
std::uint64_t key_of(const Eigen::VectorXi& coordinates) {
  std::uint64_t key = 0;
  for (const int coordinate : coordinates) key = stream(key, static_cast<std::uint32_t>(coordinate));
  return key;
}

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

void CellWeights::add(double weight) {
  const std::size_t i = sums_.size() + 1;
  for (std::size_t part = 1; part < width(i); part *= 2) weight += sums_[i - part - 1];
  sums_.push_back(weight);
}

void CellWeights::change(std::size_t index, double difference) {
  for (std::size_t i = index + 1; i <= sums_.size(); i += width(i)) sums_[i - 1] += difference;
}

std::size_t CellWeights::at(double share) const {
  double sum = 0.0;
  for (std::size_t i = sums_.size(); i > 0; i -= width(i)) sum += sums_[i - 1];
  double left = share * sum;
  std::size_t step = 1;
  while (2 * step <= sums_.size()) step *= 2;
  std::size_t before = 0;
  // The last one takes what rounding leaves.
  for (; step > 0; step /= 2) {
    const std::size_t i = before + step;
    if (i >= sums_.size() || left <= sums_[i - 1]) continue;
    left -= sums_[i - 1];
    before = i;
  }
  return before;
}

void DensityGrid::add(int node, const Eigen::VectorXi& coordinates) {
  const auto [found, is_new] = index_.try_emplace(key_of(coordinates), static_cast<std::uint32_t>(cells_.size()));
  if (is_new) {
    cells_.emplace_back();
    weights_.add(1.0);
  }
  Cell& cell = cells_[found->second];
  const std::uint32_t size = cell.size;
  if ((size & (size - 1)) == 0) {
    const auto block = static_cast<std::uint32_t>(pool_.size());
    pool_.resize(block + std::max(2 * size, 1u));
    std::copy_n(pool_.begin() + cell.block, size, pool_.begin() + block);
    cell.block = block;
  }
  pool_[cell.block + cell.size++] = node;
  if (size > 0) weights_.change(found->second, 1.0 / cell.size - 1.0 / size);
}

int DensityGrid::draw(ompl::RNG& rng) const {
  const Cell& cell = cells_[weights_.at(rng.uniform01())];
  return pool_[cell.block + static_cast<std::uint32_t>(rng.uniformInt(0, static_cast<int>(cell.size) - 1))];
}

std::vector<int> DensityGrid::nodes() const {
  std::vector<int> nodes;
  for (const Cell& cell : cells_) {
    const auto first = pool_.begin() + cell.block;
    nodes.insert(nodes.end(), first, first + cell.size);
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
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

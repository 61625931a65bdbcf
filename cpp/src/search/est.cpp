#include "search/est.hpp"

#include <algorithm>

namespace energymargin::search {

Est::Est(BoundedProblem& problem, std::uint64_t seed)
    : NodePlanner(problem, "EST"), projection_(si_->getStateSpace()->getDefaultProjection()) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  setup();
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

}  // namespace energymargin::search

#include "search/rrt.hpp"

#include <algorithm>

namespace energymargin::search {
namespace {

constexpr int sampled = -1;  // as a node

constexpr double rounding = 1e-12;  // of distances

}  // namespace

Rrt::Rrt(BoundedProblem& problem) : NodePlanner(problem, "RRT"), state_sampler_(si_->allocStateSampler()) {
  sample_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
  nodes_.setDistanceFunction([this](int a, int b) { return si_->distance(state(a), state(b)); });
  setup();
}

void Rrt::clear() {
  Planner::clear();
  nodes_.clear();
  states_.clear();
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

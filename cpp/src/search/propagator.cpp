#include "energymargin/search/propagator.hpp"

#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>

#include "energymargin/search/cost_space.hpp"

namespace energymargin::search {
namespace {

constexpr unsigned int wrench_axes = 6;
constexpr unsigned int steps_index = 6;

// Draws wrenches evenly between their bounds, and durations as T U^(1/d) with d the number of axes that act: even in
// what they reach.
class WrenchSampler : public ompl::control::ControlSampler {
 public:
  WrenchSampler(const WrenchSpace* space, std::uint64_t seed) : ControlSampler(space), bounds_(space->getBounds()) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
    for (unsigned int axis = 0; axis < wrench_axes; ++axis) active_ += bounds_.high[axis] > 0.0 ? 1 : 0;
  }

  void sample(ompl::control::Control* control) override {
    double* values = control->as<WrenchSpace::ControlType>()->values;
    for (unsigned int axis = 0; axis < wrench_axes; ++axis) {
      const double bound = bounds_.high[axis];
      values[axis] = bound > 0.0 ? rng_.uniformReal(-bound, bound) : 0.0;
    }
    const double longest = bounds_.high[steps_index];
    values[steps_index] = std::clamp(std::ceil(longest * std::pow(rng_.uniform01(), 1.0 / active_)), 1.0, longest);
  }

 private:
  const ompl::base::RealVectorBounds& bounds_;
  int active_ = 0;
};

}  // namespace

WrenchSpace::WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed)
    : RealVectorControlSpace(states, wrench_axes + 1), seed_(seed) {
  ompl::base::RealVectorBounds bounds(wrench_axes + 1);
  for (unsigned int axis = 0; axis < wrench_axes; ++axis) {
    bounds.high[axis] = axis < 3 ? problem.force[axis] : problem.torque[axis - 3];
    bounds.low[axis] = -bounds.high[axis];
  }
  bounds.low[steps_index] = 1.0;
  bounds.high[steps_index] = std::floor(problem.duration / problem.scene.stepping().step + 1e-9);
  setBounds(bounds);
}

Wrench WrenchSpace::wrench(const ompl::control::Control* control) {
  const double* values = control->as<ControlType>()->values;
  return {Vector3(values[0], values[1], values[2]), Vector3(values[3], values[4], values[5])};
}

int WrenchSpace::steps(const ompl::control::Control* control) {
  return static_cast<int>(control->as<ControlType>()->values[steps_index]);
}

ompl::control::ControlSamplerPtr WrenchSpace::allocDefaultControlSampler() const {
  return std::make_shared<WrenchSampler>(this, seed_);
}

Propagator::Propagator(const ompl::control::SpaceInformationPtr& si, const Problem& problem, int nodes)
    : StatePropagator(si),
      world_(problem.scene),
      edge_start_(problem),
      object_(world_.layout().offset(problem.scene.with_role(Role::object).front())),
      step_(problem.scene.stepping().step) {
  make_room(nodes + 1);
  tree_.states.row(0) = problem.state.transpose();
  tree_.costs[0] = 0.0;
  tree_.parents[0] = -1;
  tree_.controls.row(0).setZero();
  tree_.durations[0] = 0.0;
}

void Propagator::propagate(const ompl::base::State* from, const ompl::control::Control* control, double,
                           ompl::base::State* to) const {
  const auto* parent = from->as<CostSpace::StateType>();
  const int parent_node = parent->node;
  const Wrench wrench = WrenchSpace::wrench(control);
  const int steps = WrenchSpace::steps(control);
  const Rollout rollout = world_.rollout_unchecked(edge_start_(tree_.states.row(parent_node)), wrench, steps);
  const double cost = parent->cost + rollout.effort;

  const int node = ++nodes_;
  if (node >= tree_.costs.size()) make_room(2 * tree_.costs.size());  // some planners go on a little after the end
  tree_.states.row(node) = rollout.state.transpose();
  tree_.costs[node] = cost;
  tree_.parents[node] = parent_node;
  tree_.controls.row(node) << wrench.force.transpose(), wrench.torque.transpose();
  tree_.durations[node] = steps * step_;

  auto* result = to->as<CostSpace::StateType>();
  result->object = StateLayout::read(rollout.state.data() + object_);
  result->cost = cost;
  result->node = node;
}

void Propagator::make_room(Eigen::Index rows) const {
  tree_.states.conservativeResize(rows, world_.layout().dimension());
  tree_.costs.conservativeResize(rows);
  tree_.parents.conservativeResize(rows);
  tree_.controls.conservativeResize(rows, Eigen::NoChange);
  tree_.durations.conservativeResize(rows);
}

Tree Propagator::take_tree() {
  make_room(nodes_ + 1);
  return std::move(tree_);
}

}  // namespace energymargin::search

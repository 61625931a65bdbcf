#include "energymargin/search/propagator.hpp"

#include <ompl/control/SpaceInformation.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "energymargin/search/cost_space.hpp"

namespace energymargin::search {
namespace {

constexpr unsigned int wrench_axes = 6;  // of one object
constexpr double single_share = 0.5;     // of the draws disturb one object alone, where there are several
constexpr int first_room = 4096;         // rows of a tree that may end before all its nodes are made

// Draws wrenches evenly between their bounds, and durations as T U^(1/d) with d the number of axes that act on an
// object: even in what they reach. Of several objects it disturbs all, or one alone, which is what gets it out with the
// least work.
class WrenchSampler : public ompl::control::ControlSampler {
 public:
  WrenchSampler(const WrenchSpace* space, std::uint64_t seed) : ControlSampler(space), bounds_(space->getBounds()) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
    for (unsigned int axis = 0; axis < wrench_axes; ++axis) active_ += bounds_.high[axis] > 0.0 ? 1 : 0;
    objects_ = space->objects();
  }

  void sample(ompl::control::Control* control) override {
    double* values = control->as<WrenchSpace::ControlType>()->values;
    const unsigned int only = drawn_object();
    for (unsigned int i = 0; i < objects_ * wrench_axes; ++i) {
      const double bound = only == objects_ || only == i / wrench_axes ? bounds_.high[i] : 0.0;
      values[i] = bound > 0.0 ? rng_.uniformReal(-bound, bound) : 0.0;
    }
    const double longest = bounds_.high.back();
    values[objects_ * wrench_axes] =
        std::clamp(std::ceil(longest * std::pow(rng_.uniform01(), 1.0 / active_)), 1.0, longest);
  }

 private:
  // The one that is disturbed alone, or the number of objects for all.
  unsigned int drawn_object() {
    if (objects_ == 1 || rng_.uniform01() >= single_share) return objects_;
    return static_cast<unsigned int>(rng_.uniformInt(0, static_cast<int>(objects_) - 1));
  }

  const ompl::base::RealVectorBounds& bounds_;
  unsigned int objects_;
  int active_ = 0;
};

}  // namespace

namespace {

unsigned int controls_of(const Problem& problem) {
  return wrench_axes * static_cast<unsigned int>(problem.scene.with_role(Role::object).size()) + 1;
}

}  // namespace

WrenchSpace::WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed)
    : RealVectorControlSpace(states, controls_of(problem)), objects_(controls_of(problem) / wrench_axes), seed_(seed) {
  ompl::base::RealVectorBounds bounds(controls_of(problem));
  for (unsigned int i = 0; i < objects_ * wrench_axes; ++i) {
    const unsigned int axis = i % wrench_axes;
    bounds.high[i] = axis < 3 ? problem.force[axis] : problem.torque[axis - 3];
    bounds.low[i] = -bounds.high[i];
  }
  bounds.low.back() = 1.0;
  bounds.high.back() = std::floor(problem.duration / problem.scene.stepping().step + 1e-9);
  setBounds(bounds);
}

Disturbance WrenchSpace::wrenches(const ompl::control::Control* control) const {
  const double* values = control->as<ControlType>()->values;
  Disturbance wrenches;
  for (unsigned int i = 0; i < objects_; ++i, values += wrench_axes) {
    wrenches.push_back({Vector3(values[0], values[1], values[2]), Vector3(values[3], values[4], values[5])});
  }
  return wrenches;
}

int WrenchSpace::steps(const ompl::control::Control* control) const {
  return static_cast<int>(control->as<ControlType>()->values[objects_ * wrench_axes]);
}

ompl::control::ControlSamplerPtr WrenchSpace::allocDefaultControlSampler() const {
  return std::make_shared<WrenchSampler>(this, seed_);
}

Propagator::Propagator(const ompl::control::SpaceInformationPtr& si, const Problem& problem, int nodes,
                       const Limit& limit)
    : StatePropagator(si),
      limit_(limit),
      world_(problem.scene),
      edge_start_(problem),
      step_(problem.scene.stepping().step) {
  for (const std::size_t object : problem.scene.with_role(Role::object)) {
    objects_.push_back(world_.layout().offset(object));
  }
  make_room(std::min(nodes, first_room) + 1);
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
  const auto& controls = *si_->getControlSpace()->as<WrenchSpace>();
  const Disturbance wrenches = controls.wrenches(control);
  const int steps = controls.steps(control);
  const Rollout rollout = world_.rollout_unchecked(edge_start_(tree_.states.row(parent_node)), wrenches, steps, limit_);
  auto* result = to->as<CostSpace::StateType>();
  if (rollout.steps < steps) {
    result->cost = std::numeric_limits<double>::infinity();
    return;
  }
  const double cost = parent->cost + rollout.effort;

  const int node = ++nodes_;
  if (node >= tree_.costs.size()) make_room(2 * tree_.costs.size());
  tree_.states.row(node) = rollout.state.transpose();
  tree_.costs[node] = cost;
  tree_.parents[node] = parent_node;
  for (std::size_t i = 0; i < wrenches.size(); ++i) {
    tree_.controls.row(node).segment<6>(static_cast<Eigen::Index>(6 * i)) << wrenches[i].force.transpose(),
        wrenches[i].torque.transpose();
  }
  tree_.durations[node] = steps * step_;

  for (std::size_t i = 0; i < objects_.size(); ++i) {
    result->objects[i] = StateLayout::read(rollout.state.data() + objects_[i]);
  }
  result->cost = cost;
  result->node = node;
}

void Propagator::make_room(Eigen::Index rows) const {
  tree_.states.conservativeResize(rows, world_.layout().dimension());
  tree_.costs.conservativeResize(rows);
  tree_.parents.conservativeResize(rows);
  tree_.controls.conservativeResize(rows, wrench_axes * static_cast<Eigen::Index>(objects_.size()));
  tree_.durations.conservativeResize(rows);
}

Tree Propagator::take_tree() {
  make_room(nodes_ + 1);
  return std::move(tree_);
}

}  // namespace energymargin::search

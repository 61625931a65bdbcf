#include "search/est.hpp"

#include <ompl/base/ProjectionEvaluator.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace energymargin::search {
namespace {

// Cells a longest edge leads through, and cells between 0 and the bound on the cost.
constexpr double cells_per_edge = 8.0;
constexpr double cells_of_cost = 4.0;

// OMPL numbers cells by int; what lies farther out is in the last one.
double within_cells(double coordinate) {
  if (std::isnan(coordinate)) {
    throw std::domain_error("a coordinate of EST's grid is nan, expected a number: the node's state is not finite");
  }
  using Cell = std::numeric_limits<int>;
  return std::clamp(coordinate, static_cast<double>(Cell::min()), static_cast<double>(Cell::max()));
}

// Six coordinates an object, so that no motion of one makes up for that of another, the cost, and with a horizon the
// time.
class Projection : public ompl::base::ProjectionEvaluator {
 public:
  explicit Projection(const std::shared_ptr<ompl::base::StateSpace>& space)
      : ProjectionEvaluator(space), cost_space_(*space->as<CostSpace>()) {
    setCellSizes(std::vector<double>(getDimension(), 1.0));
  }

  unsigned int getDimension() const override { return timeless_dimension() + (cost_space_.horizon() ? 1 : 0); }

  void project(const ompl::base::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override {
    const auto* node = state->as<CostSpace::StateType>();
    const double bound = cost_space_.bound();
    for (std::size_t i = 0; i < node->objects.size(); ++i) {
      const BodyState& start = cost_space_.starts()[i];
      const Scales& scales = cost_space_.scales()[i];
      auto object = projection.segment<6>(6 * static_cast<Eigen::Index>(i));
      object.head<3>() = cells_per_edge / scales.position * (node->objects[i].position - start.position);
      object.tail<3>() = cells_per_edge / scales.orientation * turned(start, node->objects[i]);
    }
    const Eigen::Index cost = timeless_dimension() - 1;
    projection[cost] = std::isfinite(bound) && bound > 0.0 ? cells_of_cost * node->cost / bound : 0.0;
    if (cost_space_.horizon()) projection[cost + 1] = cells_per_edge / cost_space_.duration() * node->time;
    for (double& coordinate : projection) coordinate = within_cells(coordinate);
  }

 private:
  unsigned int timeless_dimension() const { return 6 * static_cast<unsigned int>(cost_space_.starts().size()) + 1; }

  const CostSpace& cost_space_;
};

}  // namespace

Est::Est(const BoundedProblem& problem, std::uint64_t seed) : EST(problem.space_information()), problem_(problem) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  setProblemDefinition(problem.definition());
  setProjectionEvaluator(std::make_shared<Projection>(problem.space_information()->getStateSpace()));
  setRange(problem.space().getMaximumExtent());
  setup();
}

void Est::prune(double bound) {
  std::vector<Motion*> motions;
  for (const auto& cell : tree_.grid) {
    motions.insert(motions.end(), cell.second->data.motions_.begin(), cell.second->data.motions_.end());
  }
  tree_.grid.clear();
  tree_.size = 0;
  pdf_.clear();
  lastGoalMotion_ = nullptr;
  // In the order in which they were made: the grid's own order is that of a hash.
  std::sort(motions.begin(), motions.end(), [](const Motion* a, const Motion* b) {
    return a->state->as<CostSpace::StateType>()->node < b->state->as<CostSpace::StateType>()->node;
  });
  for (Motion* motion : motions) {
    if (problem_.worth_keeping(motion->state->as<CostSpace::StateType>()->node, bound)) {
      addMotion(motion);
    } else {
      forget(motion);
    }
  }
}

void Est::forget(Motion* motion) {
  si_->freeState(motion->state);
  siC_->freeControl(motion->control);
  delete motion;
}

}  // namespace energymargin::search

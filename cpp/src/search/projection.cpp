#include "search/projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "search/cost_space.hpp"

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

}  // namespace

Projection::Projection(const CostSpace& space) : ProjectionEvaluator(&space), cost_space_(space) {
  setCellSizes(std::vector<double>(getDimension(), 1.0));
}

unsigned int Projection::getDimension() const { return timeless_dimension() + (cost_space_.horizon() ? 1 : 0); }

void Projection::project(const ompl::base::State* state, Eigen::Ref<Eigen::VectorXd> projection) const {
  const auto* node = state->as<CostSpace::StateType>();
  const double bound = cost_space_.bound();
  for (std::size_t i = 0; i < node->objects.size(); ++i) {
    const BodyState& start = cost_space_.starts()[i];
    const Scales& scales = cost_space_.scales()[i];
    auto object = projection.segment<6>(6 * static_cast<Eigen::Index>(i));
    object.head<3>() = cells_per_edge / scales.position * (node->objects[i].position - start.position);
    object.tail<3>() = cells_per_edge / scales.orientation * rotation(start, node->objects[i]);
  }
  const Eigen::Index cost = timeless_dimension() - 1;
  projection[cost] = std::isfinite(bound) && bound > 0.0 ? cells_of_cost * node->cost / bound : 0.0;
  if (cost_space_.horizon()) projection[cost + 1] = cells_per_edge / cost_space_.duration() * node->time;
  for (double& coordinate : projection) coordinate = within_cells(coordinate);
}

unsigned int Projection::timeless_dimension() const {
  return 6 * static_cast<unsigned int>(cost_space_.starts().size()) + 1;
}

}  // namespace energymargin::search

#include "search/propagator.hpp"

#include <ompl/control/SpaceInformation.h>

#include <limits>

#include "search/wrench_space.hpp"

namespace energymargin::search {

Propagator::Propagator(const ompl::control::SpaceInformationPtr& si, RolloutTree& tree)
    : StatePropagator(si), tree_(tree) {}

void Propagator::propagate(const ompl::base::State* from, const ompl::control::Control* control, double,
                           ompl::base::State* to) const {
  const Edge edge = si_->getControlSpace()->as<WrenchSpace>()->edge(control);
  const int node = tree_.extend(node_of(from), edge);
  auto& result = *to->as<CostSpace::StateType>();
  if (node >= 0) return tree_.describe(node, result);
  result.cost = std::numeric_limits<double>::infinity();
  result.node = node;
}

}  // namespace energymargin::search

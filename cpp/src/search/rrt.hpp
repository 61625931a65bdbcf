#pragma once
// RRT with pruning: the node nearest to a random state, cost and, with a horizon, time is extended.

#include <ompl/control/planners/rrt/RRT.h>

#include <cstdint>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/prunable.hpp"

namespace energymargin::search {

class Rrt : public ompl::control::RRT, public Prunable {
 public:
  Rrt(const BoundedProblem& problem, std::uint64_t seed);

  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override;

  void prune(double bound) override;

 private:
  const BoundedProblem& problem_;
};

}  // namespace energymargin::search

#pragma once
// RRT with pruning: the node nearest to a random state, cost and, with a horizon, time is extended.

#include <ompl/base/StateSampler.h>
#include <ompl/datastructures/NearestNeighborsGNAT.h>

#include <memory>
#include <vector>

#include "search/node_planner.hpp"

namespace energymargin::search {

//! A planner as OMPL's RRT, without its bias to the goal. Samples depend on the seed of the problem.
class Rrt : public NodePlanner {
 public:
  //! The problem has to outlive this.
  explicit Rrt(BoundedProblem& problem);

  //! The tree stays that of the problem: it begins anew at the start.
  void clear() override;

  //! A node stays if all stay that it grew from.
  void prune(double bound) override;

 private:
  bool empty() const override { return nodes_.size() == 0; }
  void add(int node) override;
  std::vector<EdgeFrom> draw_round() override;
  int nearest_to_sample() const;
  const ompl::base::State* state(int node) const;

  ompl::base::StateSamplerPtr state_sampler_;
  CostSpace::StateType sample_;
  std::vector<std::unique_ptr<CostSpace::StateType>> states_;  // of the tree's nodes that are among `nodes_`
  ompl::NearestNeighborsGNAT<int> nodes_;                      // -1 would be the sample
};

}  // namespace energymargin::search

#pragma once
// EST with pruning: nodes in thinly settled regions are extended first.

#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <vector>

#include "search/density_grid.hpp"
#include "search/node_planner.hpp"

namespace energymargin::search {

//! A planner as OMPL's EST, which needs of a node its row in the tree and its cell. The density is counted in a grid
//! over each object's change of position and orientation, with a horizon the time and, below a finite bound, the cost.
//! All nodes of a round are drawn from the tree as it is before the round.
class Est : public NodePlanner {
 public:
  //! The problem has to outlive this.
  Est(BoundedProblem& problem, std::uint64_t seed);

  //! How many nodes a round extends, but no more than the tree has; 1 at first, as published.
  void set_nodes_per_round(int count) { nodes_per_round_ = count; }

  //! The tree stays that of the problem: it begins anew at the start.
  void clear() override;

  void prune(double bound) override;

 private:
  bool empty() const override { return grid_.empty(); }
  void add(int node) override;
  std::vector<EdgeFrom> draw_round() override;

  int nodes_per_round_ = 1;
  ompl::RNG rng_;
  ompl::base::ProjectionEvaluatorPtr projection_;
  DensityGrid grid_;
};

}  // namespace energymargin::search

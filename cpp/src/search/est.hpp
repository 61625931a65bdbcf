#pragma once
// EST with pruning: nodes in thinly settled regions are extended first.

#include <ompl/base/Planner.h>
#include <ompl/control/ControlSampler.h>
#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <vector>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/edge.hpp"
#include "energymargin/search/prunable.hpp"
#include "search/cost_space.hpp"
#include "search/density_grid.hpp"

namespace energymargin::search {

//! A planner as OMPL's EST, which needs of a node its row in the tree and its cell. The density is counted in a grid
//! over each object's change of position and orientation, with a horizon the time and, below a finite bound, the cost.
//! It grows in rounds: all nodes of a round are drawn from the tree as it is before the round.
class Est : public ompl::base::Planner, public Prunable {
 public:
  //! The problem has to outlive this.
  Est(BoundedProblem& problem, std::uint64_t seed);

  //! How many nodes a round extends, but no more than the tree has; 1 at first, as published.
  void set_nodes_per_round(int count) { nodes_per_round_ = count; }

  //! A solution is told as the state in which it ends: the path to it is in the problem's tree.
  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override;

  //! The tree stays that of the problem: it begins anew at the start.
  void clear() override;

  void prune(double bound) override;

 private:
  void add(int node);
  std::vector<EdgeFrom> draw_round();
  Edge draw_edge(int node);
  void solved_by(int node);

  BoundedProblem& problem_;
  int nodes_per_round_ = 1;
  ompl::RNG rng_;
  ompl::control::ControlSamplerPtr sampler_;
  ompl::base::ProjectionEvaluatorPtr projection_;
  DensityGrid grid_;
  CostSpace::StateType state_;  // of the node at hand
};

}  // namespace energymargin::search

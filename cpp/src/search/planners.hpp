#pragma once
// EST and RRT with pruning: planners of OMPL that keep, of a node, its row in the problem's tree.

#include <ompl/base/Planner.h>
#include <ompl/base/StateSampler.h>
#include <ompl/control/ControlSampler.h>
#include <ompl/datastructures/NearestNeighborsGNAT.h>
#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "energymargin/search/ao.hpp"
#include "search/cost_space.hpp"
#include "search/density_grid.hpp"

namespace energymargin::search {

//! It grows in rounds of edges from nodes that it has. A derived planner says which nodes those are. The problem has to
//! outlive it.
class NodePlanner : public ompl::base::Planner, public Prunable {
 public:
  //! A solution is told as the state in which it ends: the path to it is in the problem's tree.
  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override;

 protected:
  NodePlanner(BoundedProblem& problem, const char* name);

  virtual bool empty() const = 0;
  virtual void add(int node) = 0;
  virtual std::vector<EdgeFrom> draw_round() = 0;

  //! An edge from a node, as the problem's controls are drawn.
  EdgeFrom draw_edge(int node);

  //! A node as OMPL sees it, until the next call.
  const CostSpace::StateType& described(int node);

  BoundedProblem& problem_;

 private:
  ompl::control::ControlSamplerPtr sampler_;
  CostSpace::StateType state_;
};

//! A planner as OMPL's EST: nodes in thinly settled regions are extended first. The density is counted in a grid over
//! each object's change of position and orientation, with a horizon the time and, below a finite bound, the cost. All
//! nodes of a round are drawn from the tree as it is before the round.
class Est : public NodePlanner {
 public:
  Est(BoundedProblem& problem, std::uint64_t seed);

  //! How many nodes a round extends, but no more than the tree has; 1 at first, as published.
  void set_nodes_per_round(int count) { nodes_per_round_ = count; }

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

//! A planner as OMPL's RRT, without its bias to the goal: the node nearest to a random state, cost and, with a horizon,
//! time is extended. Samples depend on the seed of the problem.
class Rrt : public NodePlanner {
 public:
  explicit Rrt(BoundedProblem& problem);

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

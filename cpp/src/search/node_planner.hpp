#pragma once
// What EST and RRT share: a planner of OMPL that keeps, of a node, its row in the problem's tree.

#include <ompl/base/Planner.h>
#include <ompl/control/ControlSampler.h>

#include <vector>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/prunable.hpp"
#include "search/cost_space.hpp"

namespace energymargin::search {

//! It grows in rounds of edges from nodes that it has. A derived planner says which nodes those are.
class NodePlanner : public ompl::base::Planner, public Prunable {
 public:
  //! A solution is told as the state in which it ends: the path to it is in the problem's tree.
  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override;

 protected:
  //! The problem has to outlive this.
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
  void solved_by(int node);

  ompl::control::ControlSamplerPtr sampler_;
  CostSpace::StateType state_;
};

}  // namespace energymargin::search

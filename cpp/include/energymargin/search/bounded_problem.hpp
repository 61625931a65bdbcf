#pragma once
// The feasible problem P_c of Section V-A: leave the capture set with a cost below c. The bound c can be lowered.

#include <ompl/base/Planner.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/control/SpaceInformation.h>

#include <cstdint>
#include <memory>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/cost_space.hpp"
#include "energymargin/search/propagator.hpp"

namespace energymargin::search {

class BoundedProblem {
 public:
  //! At most `nodes` rollouts, fewer if the limit is reached. The goal is the complement of `captured`,
  //! within the problem's bounds (Algorithm 1) or, if that is null, out of reach and without bounds: the tree only
  //! grows (Algorithm 2).
  BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed,
                 const Limit& limit = {});

  const ompl::control::SpaceInformationPtr& space_information() const { return si_; }
  const ompl::base::ProblemDefinitionPtr& definition() const { return definition_; }
  const CostSpace& space() const { return *space_; }

  //! True once the nodes are spent or the limit is reached.
  ompl::base::PlannerTerminationCondition termination() const;
  bool spent() const;

  double bound() const { return space_->bound(); }
  void lower_bound(double cost) { space_->lower_bound(cost); }

  int nodes() const { return propagator_->nodes(); }
  bool nodes_are_spent() const { return nodes() >= most_nodes_; }

  Tree take_tree() { return propagator_->take_tree(); }

 private:
  int most_nodes_;
  Limit limit_;
  std::shared_ptr<CostSpace> space_;
  ompl::control::SpaceInformationPtr si_;
  std::shared_ptr<Propagator> propagator_;
  ompl::base::ProblemDefinitionPtr definition_;
};

}  // namespace energymargin::search

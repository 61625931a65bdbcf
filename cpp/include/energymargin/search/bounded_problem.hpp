#pragma once
// The feasible problem P_c of Section V-A: leave the capture set with a cost below c. The bound c can be lowered.

#include <ompl/base/Planner.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/control/SpaceInformation.h>

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <set>

#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/confirmation.hpp"
#include "energymargin/search/cost_space.hpp"
#include "energymargin/search/propagator.hpp"

namespace energymargin::search {

class BoundedProblem {
 public:
  //! At most `nodes` nodes, by default one a rollout; fewer if the limit is reached. The goal is the complement of
  //! `captured`, within the problem's bounds (Algorithm 1) or, if that is null, out of reach and without bounds: the
  //! tree only grows (Algorithm 2).
  BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed, const Limit& limit = {},
                 Sampling sampling = Sampling::uniform);

  //! OMPL's checkers refer to this very object.
  BoundedProblem(const BoundedProblem&) = delete;
  BoundedProblem& operator=(const BoundedProblem&) = delete;

  //! From now on up to so many states of a rollout count as nodes; planners go on from its end alone.
  void set_nodes_per_edge(int count) { propagator_->set_nodes_per_edge(count); }

  //! From now on `made`, unless it is null, goes up with each node. It has to outlive this.
  void count_in(std::atomic<int>* made) { propagator_->count_in(made); }

  //! From now on a rollout ends where it is seen outside of the capture set; with a clock it always does.
  void stop_at_escape();

  const ompl::control::SpaceInformationPtr& space_information() const { return si_; }
  const ompl::base::ProblemDefinitionPtr& definition() const { return definition_; }
  const CostSpace& space() const { return *space_; }

  //! True once there are `nodes`, or all are spent, or the limit is reached.
  ompl::base::PlannerTerminationCondition termination(int nodes = std::numeric_limits<int>::max()) const;
  bool spent() const;

  double bound() const { return space_->bound(); }
  void lower_bound(double cost) { space_->lower_bound(cost); }

  int nodes() const { return propagator_->nodes(); }
  bool nodes_are_spent() const { return nodes() >= most_nodes_; }

  //! The node that an edge from `node` leads to; it counts as one of the nodes. -1 if the limit was reached first.
  int extend(int node, const Edge& edge) { return propagator_->extend(node, edge); }

  //! With a clock, the node that the undisturbed future leads to, besides the `nodes`: it is an escape if that leaves
  //! the capture set, be it through Z_b or not. -1 without a clock, or if the limit was reached first.
  int extend_undisturbed();

  //! Steps from the root to a node, and to the horizon; none without a clock.
  int time(int node) const { return propagator_->time(node); }
  std::optional<int> horizon() const;

  //! Whether the escape that ends in a node leads out in a finer simulation too; none if the limit was reached first.
  std::optional<bool> confirmed(int node);

  //! From now on a node is no escape, and nothing grows from it.
  void discard(int node) { discarded_.insert(node); }

  //! Whether a planner's tree still needs a node. A search that is over needs none: in a large tree it would take
  //! seconds to put them in order.
  bool worth_keeping(int node, double bound) const {
    return cost(node) < bound && discarded_.count(node) == 0 && !spent();
  }

  //! Whether a node is below the bound and within Z_b, and whether it is outside of the capture set; -1 is neither.
  //! With a clock, whether it is an escape; at the horizon nothing else is allowed, since nothing can grow from it.
  bool allowed(int node) const;
  bool escaped(int node) const;

  double cost(int node) const { return propagator_->cost(node); }
  int diverged() const { return propagator_->diverged(); }
  Edge edge(int node) const { return propagator_->edge(node); }
  std::vector<int> path_to(int node) const { return propagator_->path_to(node); }

  //! Of the first `nodes` nodes.
  Tree take_tree(int nodes) { return propagator_->take_tree(nodes); }
  Tree take_tree() { return take_tree(nodes()); }

 private:
  int most_nodes_;
  Limit limit_;
  std::shared_ptr<CostSpace> space_;
  ompl::control::SpaceInformationPtr si_;
  std::shared_ptr<Propagator> propagator_;
  std::optional<Membership> captured_;
  std::optional<Membership> within_;
  std::optional<Problem> problem_;  // with `captured_region_`, what `confirmation_` is made of at the first escape
  std::optional<Region> captured_region_;
  std::optional<Confirmation> confirmation_;
  std::set<int> discarded_;
  ompl::base::ProblemDefinitionPtr definition_;
};

}  // namespace energymargin::search

#pragma once
// The feasible problem P_c of Section V-A: leave the capture set with a cost below c. The bound c can be lowered.

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/control/SpaceInformation.h>

#include <atomic>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

class Confirmation;
class CostSpace;
struct Stretch;

//! A planner of OMPL works on `space_information` and `definition`. Its states are those of the objects with the effort
//! since the root, eq. 9; its controls are a wrench on each object and how long they last. Each rollout is a node of
//! one tree, whose node 0 is the root, and ends where its cost reaches the bound c.
class BoundedProblem {
 public:
  //! The goal is the complement of `captured`, within the problem's bounds (Algorithm 1); if it is null, there is
  //! neither (Algorithm 2). Edges that are asked for at once are made on up to so many `threads`.
  BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed, const Limit& limit = {},
                 Sampling sampling = Sampling::uniform, int threads = 1);
  ~BoundedProblem();

  //! OMPL's checkers refer to this very object.
  BoundedProblem(const BoundedProblem&) = delete;
  BoundedProblem& operator=(const BoundedProblem&) = delete;

  //! From now on up to so many states of a rollout are nodes: its end, and evenly spaced ones that no planner extends.
  void set_nodes_per_edge(int count) { nodes_per_edge_ = count; }

  //! From now on `node_counter`, unless it is null, goes up with each node. It has to outlive this.
  void count_in(std::atomic<int>* node_counter) { node_counter_ = node_counter; }

  //! From now on a rollout ends where it is seen outside of the capture set; with a clock it always does.
  void stop_at_escape() { stops_at_escape_ = true; }

  const ompl::control::SpaceInformationPtr& space_information() const { return si_; }
  const ompl::base::ProblemDefinitionPtr& definition() const { return definition_; }

  //! True once there are `nodes`, or all are spent, or the limit is reached.
  ompl::base::PlannerTerminationCondition termination(int nodes = std::numeric_limits<int>::max()) const;
  bool spent() const { return nodes_are_spent() || limit_.reached() || failure_; }

  //! The bound c on the cost [J]; inf at first.
  double bound() const;
  void lower_bound(double cost);

  //! Nodes so far, besides the root.
  int nodes() const { return nodes_; }
  bool nodes_are_spent() const { return nodes() >= most_nodes_; }

  //! Rollouts for which there are nodes, however many nodes each has.
  int rollouts_left() const { return (most_nodes_ - nodes_ + nodes_per_edge_ - 1) / nodes_per_edge_; }

  //! Simulation steps of the first `nodes` nodes, but for rollouts that diverged and confirmations.
  const StepCounts& counts(int nodes) const { return counts_[static_cast<std::size_t>(nodes)]; }

  //! Rollouts that diverged so far.
  int diverged() const { return diverged_; }

  //! Sets a state of the `space_information` to a node's.
  void describe(int node, ompl::base::State* state) const;

  //! A node's state, shape (n,), its effort from the root, eq. 8 [J], and its time since the root [steps].
  State state(int node) const { return tree_.states.row(node); }
  double cost(int node) const { return tree_.costs[node]; }
  int time(int node) const { return times_[static_cast<std::size_t>(node)]; }

  //! [steps]; none without a clock.
  const std::optional<int>& horizon() const { return horizon_; }

  //! The edge that led to a node, and where it began; -1 for the root.
  Edge edge(int node) const;
  int parent(int node) const { return tree_.parents[node]; }
  std::vector<int> path_to(int node) const { return tree_.path_to(node); }

  //! Whether a node is below the bound (`bound`, or else c) and within Z_b, and whether it is an escape. Node -1 is
  //! neither, nor is what was discarded. At the horizon only escapes are allowed, since nothing can grow there.
  bool allowed(int node, std::optional<double> bound = std::nullopt) const;
  bool escaped(int node) const;

  //! Whether a node's state is its parent's: without a wrench it stays there.
  bool at_rest(int node) const;

  //! Whether a planner's tree still needs a node. A search that is over needs none: to order a large tree takes long.
  bool worth_keeping(int node, double bound) const;

  //! The last node that an edge leads to, of infinite cost if its rollout diverges; -1 if the limit was reached first.
  int extend(int node, const Edge& edge, std::optional<double> bound = std::nullopt);

  //! These nodes for several edges, in their order, up to the first that the limit cut short: on any threads the same.
  std::vector<int> extend(const std::vector<EdgeFrom>& edges, std::optional<double> bound = std::nullopt);

  //! The node of the undisturbed future, besides the `nodes`; -1 without a clock, or if the limit was reached first.
  int extend_undisturbed();

  //! Whether the escape that ends in a node leads out in a finer simulation too; none if the limit was reached first.
  std::optional<bool> confirm(int node);

  //! From now on a node is no escape, and nothing grows from it.
  void discard(int node) { discarded_.insert(node); }

  //! What OMPL asks for. An exception would make its planners leak: the search ends, and `rethrow` throws it then.
  template <typename Answer>
  bool answer(const Answer& of) const {
    try {
      return of();
    } catch (...) {
      failure_ = std::current_exception();
      return false;
    }
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

  //! The first `nodes` nodes, by default all; leaves this empty.
  Tree take_tree(std::optional<int> nodes = std::nullopt);

 private:
  struct Simulations;  // the worlds and the threads that make the rollouts

  std::optional<Stretch> roll_out(World& world, const EdgeFrom& from, const Watch& watch) const;
  std::vector<std::optional<Stretch>> roll_out_together(const std::vector<EdgeFrom>& edges,
                                                        const std::vector<Watch>& watches) const;
  int add(const EdgeFrom& from, const std::optional<Stretch>& stretch);
  int add(int from, const Edge& edge, int steps, double effort, const State& state);
  void make_room(Eigen::Index rows);

  int most_nodes_;
  int nodes_per_edge_ = 1;
  bool stops_at_escape_ = false;
  std::atomic<int>* node_counter_ = nullptr;
  Limit limit_;
  std::shared_ptr<CostSpace> space_;
  std::unique_ptr<Simulations> simulations_;
  std::optional<int> horizon_;
  double step_;  // [s]
  Kinematics kinematics_;
  std::vector<std::size_t> objects_;  // by their indices in the scene
  ompl::control::SpaceInformationPtr si_;
  ompl::base::ProblemDefinitionPtr definition_;
  std::optional<Membership> captured_;
  std::optional<Membership> within_;
  std::optional<Problem> problem_;  // from whose capture set there are escapes, for `confirmation_` at the first one
  std::unique_ptr<Confirmation> confirmation_;

  Tree tree_;
  std::vector<int> times_;          // of each node
  std::vector<bool> escaped_;       // with a clock: whether an escape ends in each node
  std::vector<StepCounts> counts_;  // up to each node
  int nodes_ = 0;
  int diverged_ = 0;
  Eigen::Index dimension_ = 0;  // of the scene's states; those of the tree have the robot's memory behind it
  std::set<int> discarded_;
  mutable std::exception_ptr failure_;
  std::shared_ptr<const void> quiet_;
};

}  // namespace energymargin::search

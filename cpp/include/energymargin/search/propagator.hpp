#pragma once
// World as an OMPL state propagator: every rollout becomes a node of the tree.

#include <ompl/control/StatePropagator.h>

#include <atomic>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/cost_space.hpp"
#include "energymargin/search/horizon.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/search/wrench_space.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! The augmented dynamics G of eq. 9: z' by a rollout, c' = c + effort. Records each rollout, until its cost reaches
//! the bound c: what comes after it is valid nowhere.
class Propagator : public ompl::control::StatePropagator {
 public:
  //! Of at most `nodes` nodes; the world is built here. With a clock, rollouts end at the horizon or where they are
  //! outside of `captured`, which may be null.
  Propagator(const ompl::control::SpaceInformationPtr& si, const Problem& problem, int nodes, const Limit& limit = {},
             const Region* captured = nullptr);

  //! From now on up to so many states of a rollout are nodes: its end and, before it, evenly spaced ones on its way.
  void set_nodes_per_edge(int count) { nodes_per_edge_ = count; }

  //! From now on `made`, unless it is null, goes up with each node but the undisturbed future.
  void count_in(std::atomic<int>* made) { made_ = made; }

  //! From now on a rollout ends where `outside` says so, which is asked every few steps. Without a clock.
  void end_where(std::function<bool(const State&)> outside) { ends_ = std::move(outside); }

  //! `duration` is not looked at: the control carries its own. A rollout that reaches the limit leads to no node, and
  //! to an infinite cost, which is valid nowhere.
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double duration,
                 ompl::base::State* to) const override;
  bool canPropagateBackward() const override { return false; }

  //! The last of the nodes that an edge from `node` leads to; -1, and no node, if the limit was reached before. A
  //! rollout that diverges leads to a node of infinite cost, at the state where it began.
  int extend(int node, const Edge& edge) const;

  //! The node that the undisturbed future leads to; -1 if the limit was reached before. With a clock.
  int extend_undisturbed() const;

  //! A node as planners see it.
  void describe(int node, CostSpace::Values& values) const;

  //! The edge that led to a node.
  Edge edge(int node) const;

  //! Nodes made so far.
  int nodes() const { return nodes_; }

  //! State of a node.
  auto state(int node) const { return tree_.states.row(node); }
  double cost(int node) const { return tree_.costs[node]; }

  //! Steps from the root to a node.
  int time(int node) const { return times_[static_cast<std::size_t>(node)]; }

  //! With a clock: whether an escape ends in a node.
  bool escaped(int node) const { return escaped_[static_cast<std::size_t>(node)]; }

  const std::optional<Horizon>& horizon() const { return horizon_; }

  //! Rollouts that diverged so far.
  int diverged() const { return diverged_; }

  std::vector<int> path_to(int node) const { return tree_.path_to(node); }

  //! The tree of the first `nodes` rollouts; leaves the propagator empty.
  Tree take_tree(int nodes);

 private:
  std::optional<Stretch> roll_out(int from, const Edge& edge, const Watch& watch) const;
  int grow(int from, const Edge& edge) const;
  int add(int from, const Edge& edge, int steps, double effort, const State& state) const;
  void make_room(Eigen::Index rows) const;

  const CostSpace& space_;
  int most_nodes_;
  int nodes_per_edge_ = 1;
  std::function<bool(const State&)> ends_;
  std::atomic<int>* made_ = nullptr;

  Limit limit_;
  mutable World world_;
  EdgeStart edge_start_;
  std::optional<Horizon> horizon_;
  mutable Tree tree_;
  mutable std::vector<int> times_;
  mutable std::vector<bool> escaped_;
  mutable int nodes_ = 0;
  mutable int diverged_ = 0;
  std::vector<int> objects_;  //!< offsets of the objects' numbers in a state
  double step_;
};

}  // namespace energymargin::search

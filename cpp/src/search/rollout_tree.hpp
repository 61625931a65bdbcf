#pragma once
// The tree of a search while it grows: every rollout becomes a node.

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/crew.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/edge.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"
#include "search/cost_space.hpp"
#include "search/horizon.hpp"

namespace energymargin::search {

//! The augmented dynamics G of eq. 9: z' by a rollout, c' = c + effort. Records each rollout, until its cost reaches
//! the bound c: what comes after it is valid nowhere.
class RolloutTree {
 public:
  //! Of at most `nodes` nodes; the worlds are built here, one for each of the threads that make a round. The bound is
  //! that of `space`, which has to outlive this. With a clock, rollouts end at the horizon or where they are outside of
  //! `captured`, which may be null.
  RolloutTree(const Problem& problem, const CostSpace& space, int nodes, const Limit& limit = {},
              const Region* captured = nullptr, int threads = 1);

  //! From now on up to so many states of a rollout are nodes: its end and, before it, evenly spaced ones on its way.
  void set_nodes_per_edge(int count) { nodes_per_edge_ = count; }
  int nodes_per_edge() const { return nodes_per_edge_; }

  //! From now on `node_counter`, unless it is null, goes up with each node but the undisturbed future.
  void count_in(std::atomic<int>* node_counter) { node_counter_ = node_counter; }

  //! From now on a rollout ends where `outside` says so, which is asked every few steps. Without a clock.
  void end_where(std::function<bool(const State&)> outside) { outside_ = std::move(outside); }

  //! The last of the nodes that an edge from `node` leads to; -1, and no node, if the limit was reached before. A
  //! rollout that diverges leads to a node of infinite cost, at the state where it began. `bound` is in place of c.
  int extend(int node, const Edge& edge) { return extend(node, edge, space_.bound()); }
  int extend(int node, const Edge& edge, double bound);

  //! The same of each edge of a round below c, in its order: the same nodes on any number of threads. Fewer if the
  //! limit was reached: those before the first edge that it cut short.
  std::vector<int> extend(const std::vector<EdgeFrom>& round);

  //! The node that the undisturbed future leads to; -1 if the limit was reached before. With a clock.
  int extend_undisturbed();

  //! Nodes so far, besides the root.
  int nodes() const { return nodes_; }

  //! State of a node, shape (n,).
  auto state(int node) const { return tree_.states.row(node); }

  //! Effort from the root to a node [J].
  double cost(int node) const { return tree_.costs[node]; }

  int parent(int node) const { return tree_.parents[node]; }

  //! Steps from the root to a node.
  int time(int node) const { return times_[static_cast<std::size_t>(node)]; }

  //! With a clock: whether an escape ends in a node.
  bool escaped(int node) const { return escaped_[static_cast<std::size_t>(node)]; }

  //! A node as planners see it.
  void describe(int node, CostSpace::Values& values) const;

  //! The edge that led to a node.
  Edge edge(int node) const;
  std::vector<int> path_to(int node) const { return tree_.path_to(node); }

  const std::optional<Horizon>& horizon() const { return horizon_; }

  //! Of the rollouts that led to the first `nodes` nodes; those that diverged have none.
  const StepCounts& counts(int nodes) const { return counts_[static_cast<std::size_t>(nodes)]; }

  //! Rollouts that diverged so far.
  int diverged() const { return diverged_; }

  //! The tree of the first `nodes` rollouts; leaves this empty.
  Tree take_tree(int nodes);

 private:
  std::vector<int> extend(const std::vector<EdgeFrom>& round, double bound);
  std::vector<std::optional<Stretch>> roll_out(const std::vector<EdgeFrom>& round, double bound);
  std::optional<Stretch> roll_out(World& world, const EdgeFrom& from, int nodes, double bound) const;
  int add(const EdgeFrom& from, const std::optional<Stretch>& stretch);
  int add(int from, const Edge& edge, int steps, double effort, const State& state);
  void count(const Stretch& stretch);
  void make_room(Eigen::Index rows);

  const CostSpace& space_;
  int most_nodes_;
  int nodes_per_edge_ = 1;
  std::function<bool(const State&)> outside_;
  std::atomic<int>* node_counter_ = nullptr;

  Limit limit_;
  Crew crew_;
  std::vector<std::unique_ptr<World>> worlds_;  // one a thread
  EdgeStart edge_start_;
  std::optional<Horizon> horizon_;
  std::vector<int> objects_;  // where their numbers begin in a state
  double step_;               // [s]

  Tree tree_;
  std::vector<int> times_;
  std::vector<bool> escaped_;
  std::vector<StepCounts> counts_;  // up to each node
  int nodes_ = 0;
  int diverged_ = 0;
};

}  // namespace energymargin::search

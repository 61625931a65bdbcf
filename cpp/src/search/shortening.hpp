#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the world.

#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/search/bounded_problem.hpp"
#include "search/edge_changes.hpp"

namespace energymargin::search {

//! Local search around the best escape. What it tries are rollouts like all others: rows of the tree, and they count as
//! nodes. AO-x's planner explores; this improves what the planner has found. With a clock an edge keeps its time when
//! one before it changes: what lies between them is a wait, an edge without a wrench of any length.
class Shortening {
 public:
  //! `largest` bounds the edges.
  Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed);

  //! The changes refer to this very object.
  Shortening(const Shortening&) = delete;
  Shortening& operator=(const Shortening&) = delete;

  //! Goes on from the escape that ends in `node`.
  void start(int node) { path_ = problem_.path_to(node); }

  //! Tries one push at the bounds of its axes, on one object or all, from some time on, for some time or up to the
  //! horizon: there is no escape yet, and where time is short few draws of a planner's lead to one. True if this did;
  //! then the bound has fallen to its cost. With a clock.
  bool guess();

  //! Tries one change. True if it gave a cheaper escape: then the problem's bound has fallen to its cost.
  bool attempt();

  //! The node in which the best escape ends.
  int end() const { return path_.back(); }

 private:
  std::size_t draw_node();
  TimedEdge rest(int start, int steps) const;
  TimedEdges edges_from(std::size_t node) const;
  TimedEdges with_waits(const TimedEdges& edges, int time) const;
  bool replay(std::size_t from, const TimedEdges& edges);

  BoundedProblem& problem_;
  Edge largest_;
  std::optional<int> horizon_;  // steps
  ompl::RNG rng_;
  EdgeChanges changes_;
  std::vector<int> path_;  // nodes from the root to the end of the best escape
};

}  // namespace energymargin::search

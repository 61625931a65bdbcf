#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the world.

#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/search/bounded_problem.hpp"
#include "search/edge_changes.hpp"
#include "search/polish.hpp"
#include "search/slow_motion.hpp"

namespace energymargin::search {

//! Local search around the best escape. What it tries are rollouts like all others: rows of the tree, and they count as
//! nodes. AO-x's planner explores; this improves what the planner has found. With a clock an edge keeps its time when
//! one before it changes: what lies between them is a wait, an edge without a wrench of any length.
class Shortening {
 public:
  //! `bounded` is the search in which `problem`'s escapes are replayed.
  Shortening(const Problem& problem, BoundedProblem& bounded, std::uint64_t seed);

  //! The changes refer to this very object.
  Shortening(const Shortening&) = delete;
  Shortening& operator=(const Shortening&) = delete;

  //! Goes on from the escape that ends in `node`.
  void start(int node) { path_ = problem_.path_to(node); }

  //! Waits from the root on, without a clock: an object that moves may leave by itself. True if it did.
  bool wait();

  //! Tries one push from the root, on one object or all: there is no escape yet. With a clock it is at the bounds of
  //! its axes, from some time on, for some time or up to the horizon: where time is short few draws of a planner's lead
  //! out. Without one it may be weaker, or a wait. True if it led out; then the bound has fallen to its cost.
  bool guess();

  //! Tries one change. True if it gave a cheaper escape: then the problem's bound has fallen to its cost.
  bool attempt();

  //! The node in which the best escape ends.
  int end() const { return path_.back(); }

 private:
  bool change_edges();
  bool polish();
  bool slow_down();
  std::vector<Passage> passages(int pushes);
  bool wait_on();
  std::size_t draw_node();
  TimedEdge draw_push();
  int draw_rests();
  TimedEdge rest(int start, int steps) const;
  TimedEdges edges_from(std::size_t node) const;
  TimedEdges with_waits(const TimedEdges& edges, int time) const;
  TimedEdges with_rests(TimedEdges edges, int count) const;
  Outcome replay(int node, const TimedEdges& edges);

  BoundedProblem& problem_;
  Edge largest_;
  std::optional<int> horizon_;  // steps
  ompl::RNG rng_;
  EdgeChanges changes_;
  Polish polish_;
  SlowMotion slow_motion_;
  int polished_ = -1;         // the node in which the escape ends that the polish goes on from
  int polishes_ = 0;          // attempts that were one
  int others_ = 0;            // and those that were none
  std::vector<int> path_{0};  // nodes from the root to the end of the best escape
  int waited_ = 0;            // the node in which the last wait from the root ends
};

}  // namespace energymargin::search

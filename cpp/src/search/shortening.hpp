#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the world; AO-x in turns with that.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "energymargin/search/ao.hpp"
#include "search/edge_changes.hpp"
#include "search/polish.hpp"

namespace energymargin::search {

//! Local search around the best escape. What it tries are rollouts like all others: rows of the tree, and they count as
//! nodes. AO-x's planner explores; this improves what the planner has found. Where changes no longer help, it descends
//! anew from another escape that it guesses, and then goes on with the best: the form of an escape, as the side on
//! which it leaves, is rarely changed by small steps. With a clock an edge keeps its time when one before it changes:
//! what lies between them is a wait, an edge without a wrench of any length. Then there is one descent.
class Shortening {
 public:
  //! `bounded` is the search in which `problem`'s escapes are replayed.
  Shortening(const Problem& problem, BoundedProblem& bounded, std::uint64_t seed);

  //! The changes refer to this very object.
  Shortening(const Shortening&) = delete;
  Shortening& operator=(const Shortening&) = delete;

  //! Goes on from the best escape, which ends in `node`; 0: there is none.
  void start(int node);

  //! Waits from the root on, without a clock: an object that moves may leave by itself. True if it did.
  bool wait();

  //! Tries one change, or one push from the root where a descent has no escape yet. True if it gave the cheapest escape
  //! of all: then the problem's bound has fallen to its cost.
  bool attempt();

  //! The node in which the best escape ends.
  int end() const { return best_; }

 private:
  void descend_from(int node);
  void go_on_from(int node);
  bool descends();
  bool is_best();
  bool guess();
  bool change();
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
  int best_ = 0;  // the node in which the best escape ends

  // The descent.
  std::vector<int> path_{0};                                // nodes from the root to the end of its escape
  double bound_ = std::numeric_limits<double>::infinity();  // the escape's cost
  double mark_ = bound_;                                    // a cost, and how many rollouts there were when it was it
  int marked_ = 0;
  int polishes_ = 0;   // attempts that were one
  int others_ = 0;     // and those that were none
  int polished_ = -1;  // the node in which the escape ends that the polish goes on from

  int rollouts_ = 0;
  int waited_ = 0;  // the node in which the last wait from the root ends
};

//! When best escapes are played again in a finer simulation. One that does not lead out there is no escape.
enum class Confirm {
  best,       ///< the last one, and a few on the way; the search ends if one is none, since its cost bounded the search
  each_turn,  ///< after each turn of the planner and of shortening, before it bounds the search any longer
};

//! As the function of two arguments. With `shortening`, unless it is null, a wait comes first, and then the planner and
//! it take turns: it guesses until there is an escape. The planner keeps a tenth of the nodes, with a clock half, so
//! AO-x stays asymptotically optimal. With Confirm::best it is to be done again with Confirm::each_turn if any escape
//! was discarded.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening, Confirm confirm);

}  // namespace energymargin::search

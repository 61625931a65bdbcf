#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the World.

#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/search/bounded_problem.hpp"

namespace energymargin::search {

//! Local search around the best escape. What it tries are rollouts like all others: rows of the tree, and they count as
//! nodes. AO-x's planner explores, this polishes what it found. With a clock an edge keeps its time when one before it
//! changes: what lies between them is a wait, an edge without a wrench of any length.
class Shortening {
 public:
  //! `largest` bounds the edges.
  Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed);

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
  struct TimedEdge : Edge {
    int start = 0;  // steps since the root; where no clock runs, edges follow one another whatever it says
  };
  using Edges = std::vector<TimedEdge>;
  using Change = void (Shortening::*)(Edges&);

  std::vector<Change> changes() const;
  std::size_t drawn_node();

  // Each changes the first of the edges that lead from a node of the path to its end, or several of them.
  void drop(Edges& edges);
  void halt(Edges& edges);
  void weaken(Edges& edges);
  void coast(Edges& edges);
  void nudge(Edges& edges);
  void nudge_all(Edges& edges);
  void cut(Edges& edges);
  void merge(Edges& edges);

  // With a clock alone.
  void shift(Edges& edges);
  void hasten(Edges& edges);
  void silence(Edges& edges);

  void insert_whole(Edges& edges, const TimedEdge& push) const;
  double drawn_size();
  TimedEdge nudged(TimedEdge edge);
  TimedEdge rest(int start, int steps) const;
  Edges edges_from(std::size_t node) const;
  Edges with_waits(const Edges& edges, int time) const;
  bool replay(std::size_t from, const Edges& edges);

  BoundedProblem& problem_;
  Edge largest_;
  std::optional<int> horizon_;  // steps
  std::vector<Change> changes_;
  ompl::RNG rng_;
  std::vector<int> path_;  // nodes from the root to the end of the best escape
};

}  // namespace energymargin::search

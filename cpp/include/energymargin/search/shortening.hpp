#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the World.

#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <vector>

#include "energymargin/search/bounded_problem.hpp"

namespace energymargin::search {

//! Local search around the best escape. What it tries are rollouts like all others: rows of the tree, and they count as
//! nodes. AO-x's planner explores, this polishes what it found.
class Shortening {
 public:
  //! `largest` bounds the edges.
  Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed);

  //! Goes on from the escape that ends in `node`.
  void start(int node) { path_ = problem_.path_to(node); }

  //! Tries one change. True if it gave a cheaper escape: then the problem's bound has fallen to its cost.
  bool attempt();

  //! The node in which the best escape ends.
  int end() const { return path_.back(); }

 private:
  using Edges = std::vector<Edge>;
  using Change = void (Shortening::*)(Edges&);
  static const std::vector<Change> changes;

  // Each changes the first of the edges that lead from a node of the path to its end, or several of them.
  void drop(Edges& edges);
  void halt(Edges& edges);
  void weaken(Edges& edges);
  void coast(Edges& edges);
  void nudge(Edges& edges);
  void nudge_all(Edges& edges);
  void cut(Edges& edges);
  void merge(Edges& edges);

  Edge nudged(Edge edge);
  bool replay(std::size_t from, const Edges& edges);

  BoundedProblem& problem_;
  Edge largest_;
  ompl::RNG rng_;
  std::vector<int> path_;  // nodes from the root to the end of the best escape
};

}  // namespace energymargin::search

#pragma once
// The search behind the capture score, line 3 of Algorithm 2: a tree of EST that has no goal.

#include <atomic>
#include <cstdint>
#include <limits>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

struct ExplorationOptions {
  int nodes = 1000;
  int nodes_per_edge = 1;                                  //!< states of a rollout that count as nodes, at most
  int nodes_per_round = 1;                                 //!< nodes that are extended at once, as Est does
  double bound = std::numeric_limits<double>::infinity();  //!< no edge begins at a cost that is not below it [J]
  std::uint64_t seed = 0;
  int threads = 1;  //!< that make a round; the tree does not depend on them
  Limit limit{};
  std::atomic<int>* node_counter = nullptr;  //!< goes up with each node; null: not counted
};

struct Exploration {
  Tree tree;
  bool complete = false;  //!< it has all nodes
  int diverged = 0;       //!< rollouts
  StepCounts counts{};
};

//! EST(P_c, M) with c the bound and M the nodes. The problem is valid.
Exploration explore(const Problem& problem, const ExplorationOptions& options);

}  // namespace energymargin::search

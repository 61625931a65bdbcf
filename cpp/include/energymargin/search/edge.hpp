#pragma once
// An edge of a search tree: a wrench on each object for a number of steps.

#include "energymargin/problem.hpp"
#include "energymargin/types.hpp"

namespace energymargin::search {

//! What leads from a node to the next.
using Edge = Push;

//! An edge, and the node that it leads from.
struct EdgeFrom {
  int node = 0;
  Edge edge;
};

//! The largest edge: the bounds of its wrenches, and the most steps.
Edge largest_edge(const Problem& problem);

}  // namespace energymargin::search

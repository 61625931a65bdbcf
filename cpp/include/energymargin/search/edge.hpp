#pragma once
// An edge of a search tree: a wrench on each object for a number of steps.

#include "energymargin/problem.hpp"
#include "energymargin/types.hpp"

namespace energymargin::search {

inline constexpr int wrench_axes = 6;  //!< of one object: three of its force and three of its torque

//! What leads from a node to the next.
struct Edge {
  Eigen::VectorXd wrenches;  //!< on each object: force [N], torque [N m]; shape (6 k,) for k objects
  int steps = 1;
};

//! An edge, and the node that it leads from.
struct EdgeFrom {
  int node = 0;
  Edge edge;
};

//! The largest edge: the bounds of its wrenches, and the most steps.
Edge largest_edge(const Problem& problem);

//! The wrenches of an edge, one an object.
Disturbance disturbance(const Eigen::VectorXd& wrenches);

}  // namespace energymargin::search

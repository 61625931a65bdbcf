#pragma once
// The tree of a search: its edges, how they are drawn, and each of its rollouts, as flat arrays.

#include <algorithm>
#include <vector>

#include "energymargin/types.hpp"

namespace energymargin {

struct Problem;

//! How a search draws its controls.
enum class Sampling {
  uniform,  //!< wrenches evenly between their bounds (paper, Section V)
  mixed,    //!< about half of them so; the others at their bounds, along one axis, or none at all; with a horizon also
            //!< that of the edge before, and some without a wrench last as long as they like
};

//! Nodes in the order of the search, the root first: `controls[i]`, for `durations[i]` at `parents[i]`, leads to i.
struct Tree {
  States states;              //!< (M + 1, n)
  Eigen::VectorXd costs;      //!< effort from the root, eq. 8 [J]
  Eigen::VectorXi parents;    //!< -1 for the root
  Wrenches controls;          //!< (M + 1, 6 k) for k objects; zero for the root
  Eigen::VectorXd durations;  //!< [s]

  int size() const { return static_cast<int>(costs.size()); }

  //! Times of the nodes since the root (M + 1,) [s].
  Eigen::VectorXd times() const {
    Eigen::VectorXd times = durations;  // a parent comes before its children
    for (int node = 1; node < size(); ++node) times[node] += times[parents[node]];
    return times;
  }

  //! Nodes from the root to `node`, both included.
  std::vector<int> path_to(int node) const {
    std::vector<int> path;
    for (; node >= 0; node = parents[node]) path.push_back(node);
    std::reverse(path.begin(), path.end());
    return path;
  }
};

namespace search {

//! What leads from a node to the next.
using Edge = Push;

//! An edge, and the node that it leads from.
struct EdgeFrom {
  int node = 0;
  Edge edge;
};

//! The largest edge: the bounds of its wrenches, and the most steps.
Edge largest_edge(const Problem& problem);

}  // namespace search

}  // namespace energymargin

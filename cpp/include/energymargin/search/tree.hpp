#pragma once
// The tree of a search: each of its rollouts, as flat arrays.

#include <vector>

#include "energymargin/types.hpp"

namespace energymargin {

//! Nodes in the order of the search; node 0 is the root. Node i > 0 is what `controls[i]`, applied for
//! `durations[i]` at node `parents[i]`, leads to.
struct Tree {
  States states;              //!< (M + 1, n)
  Eigen::VectorXd costs;      //!< effort from the root, eq. 8 [J]
  Eigen::VectorXi parents;    //!< -1 for the root
  Wrenches controls;          //!< (M + 1, 6 k) for k objects; zero for the root
  Eigen::VectorXd durations;  //!< [s]

  int size() const { return static_cast<int>(costs.size()); }

  //! Of the nodes, since the root (M + 1,) [s].
  Eigen::VectorXd times() const;

  //! Nodes from the root to `node`, both included.
  std::vector<int> path_to(int node) const;
};

}  // namespace energymargin

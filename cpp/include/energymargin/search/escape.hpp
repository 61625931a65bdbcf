#pragma once
// The result of a search for an escape.

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "energymargin/plausibility.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! Its steps are those of the rollouts of all searches.
struct Escape : StepCounts {
  double effort = 0.0;                          //!< Omega_esc, eq. 2 [J]; inf if no escape was found
  std::vector<std::pair<int, double>> history;  //!< (nodes so far, best effort) at each improvement
  std::vector<int> path;                        //!< nodes of the tree from the root to the escape; empty if none
  Tree tree;                                    //!< all rollouts, also those above the bound
  bool complete = true;                         //!< the nodes are spent, or nothing is left to gain
  int discarded = 0;  //!< best escapes that do not count: with a quarter of the step they do not lead out
  double discarded_effort = std::numeric_limits<double>::infinity();  //!< least effort of these [J]; inf without one
  int diverged = 0;          //!< rollouts that diverged: nodes of infinite cost
  bool undisturbed = false;  //!< with a clock: node 1 is the undisturbed future, which is not one of the `nodes`
  std::optional<double> undisturbed_exit{};  //!< when the state leaves without a disturbance [s], if that is known
  std::vector<Warning> warnings{};           //!< what speaks against the effort

  int nodes() const { return tree.size() - 1 - (undisturbed ? 1 : 0); }
};

}  // namespace energymargin

#pragma once
// The rollout tree as an OMPL state propagator.

#include <ompl/control/StatePropagator.h>

#include "search/rollout_tree.hpp"

namespace energymargin::search {

//! From a state of a CostSpace by a control of a WrenchSpace.
class Propagator : public ompl::control::StatePropagator {
 public:
  //! The tree has to outlive this.
  Propagator(const ompl::control::SpaceInformationPtr& si, RolloutTree& tree);

  //! `duration` is not looked at: the control carries its own. A rollout that reaches the limit leads to no node, and
  //! to an infinite cost, which is valid nowhere.
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double duration,
                 ompl::base::State* to) const override;
  bool canPropagateBackward() const override { return false; }

 private:
  RolloutTree& tree_;
};

}  // namespace energymargin::search

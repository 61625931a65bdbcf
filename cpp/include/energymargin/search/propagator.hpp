#pragma once
// World as an OMPL state propagator: every rollout becomes a node of the tree.

#include <ompl/control/ControlSampler.h>
#include <ompl/control/StatePropagator.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>

#include <cstdint>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! A control is a wrench on each object (6 numbers each) and the number of steps that they last.
class WrenchSpace : public ompl::control::RealVectorControlSpace {
 public:
  WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed);

  Disturbance wrenches(const ompl::control::Control* control) const;
  int steps(const ompl::control::Control* control) const;

  unsigned int objects() const { return objects_; }

  ompl::control::ControlSamplerPtr allocDefaultControlSampler() const override;

 private:
  unsigned int objects_;
  std::uint64_t seed_;
};

//! The augmented dynamics G of eq. 9: z' by a rollout, c' = c + effort. Records each rollout.
class Propagator : public ompl::control::StatePropagator {
 public:
  //! Of about `nodes` rollouts; the world is built here.
  Propagator(const ompl::control::SpaceInformationPtr& si, const Problem& problem, int nodes, const Limit& limit);

  //! `duration` is not looked at: the control carries its own. A rollout that reaches the limit leads to no node, and
  //! to an infinite cost, which is valid nowhere.
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double duration,
                 ompl::base::State* to) const override;
  bool canPropagateBackward() const override { return false; }

  //! Rollouts made so far.
  int nodes() const { return nodes_; }

  //! State of a node.
  auto state(int node) const { return tree_.states.row(node); }

  //! The tree of all rollouts; leaves the propagator empty.
  Tree take_tree();

 private:
  void make_room(Eigen::Index rows) const;

  Limit limit_;
  mutable World world_;
  EdgeStart edge_start_;
  mutable Tree tree_;
  mutable int nodes_ = 0;
  std::vector<int> objects_;  //!< offsets of the objects' numbers in a state
  double step_;
};

}  // namespace energymargin::search

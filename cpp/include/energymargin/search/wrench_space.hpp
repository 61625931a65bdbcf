#pragma once
// The controls of a search: a wrench on each object and how long they last.

#include <ompl/control/spaces/RealVectorControlSpace.h>

#include <cstdint>
#include <optional>

#include "energymargin/problem.hpp"
#include "energymargin/search/sampling.hpp"
#include "energymargin/types.hpp"

namespace energymargin::search {

//! What leads from a node to the next.
struct Edge {
  Eigen::VectorXd wrenches;  //!< on each object: force [N], torque [N m]; (6 k,) for k objects
  int steps = 1;
};

//! A control is a wrench on each object (6 numbers each) and the number of steps that they last.
class WrenchSpace : public ompl::control::RealVectorControlSpace {
 public:
  WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed,
              Sampling sampling = Sampling::uniform);

  Edge edge(const ompl::control::Control* control) const;

  unsigned int objects() const { return objects_; }
  Sampling sampling() const { return sampling_; }

  //! From a state of a CostSpace to the horizon; none without a clock.
  std::optional<int> steps_left(const ompl::base::State* state) const;

  ompl::control::ControlSamplerPtr allocDefaultControlSampler() const override;

 private:
  unsigned int objects_;
  std::uint64_t seed_;
  Sampling sampling_;
  double step_;
};

//! The largest edge: the bounds of its wrenches, and the most steps.
Edge largest_edge(const Problem& problem);

//! The wrenches of an edge, one an object.
Disturbance disturbance(const Eigen::VectorXd& wrenches);

}  // namespace energymargin::search

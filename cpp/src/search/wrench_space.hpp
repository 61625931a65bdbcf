#pragma once
// The controls of a search as OMPL sees them, and how they are drawn.

#include <ompl/control/spaces/RealVectorControlSpace.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"

namespace energymargin::search {

//! A control is a wrench on each object (6 numbers each) and the number of steps that they last.
class WrenchSpace : public ompl::control::RealVectorControlSpace {
 public:
  WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed,
              Sampling sampling = Sampling::uniform);

  //! What a control says.
  Edge edge(const ompl::control::Control* control) const;

  Sampling sampling() const { return sampling_; }

  //! Steps from a state of a CostSpace to the horizon; none without a clock.
  std::optional<int> steps_left(const ompl::base::State* state) const;

  ompl::control::ControlSamplerPtr allocDefaultControlSampler() const override;

 private:
  std::uint64_t seed_;
  Sampling sampling_;
  double step_;
};

//! OMPL tells errors alone for as long as any of these is there; then its log level is again what it was.
std::shared_ptr<const void> quiet_ompl();

}  // namespace energymargin::search

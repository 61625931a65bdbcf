#pragma once
// The bounded problem as OMPL sees it. What is made here refers to the problem, which has to outlive it.

#include <ompl/base/ProblemDefinition.h>
#include <ompl/control/SpaceInformation.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"

namespace energymargin::search {

class BoundedProblem;

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

//! The space of the controls' states: which of them are valid, and that a control leads to a node of the tree.
ompl::control::SpaceInformationPtr space_information(const std::shared_ptr<WrenchSpace>& controls,
                                                     BoundedProblem& problem);

//! The problem of a way from the root to an escape.
ompl::base::ProblemDefinitionPtr definition(const ompl::control::SpaceInformationPtr& si,
                                            const BoundedProblem& problem);

//! OMPL tells errors alone for as long as any of these is there; then its log level is again what it was.
std::shared_ptr<const void> quiet_ompl();

}  // namespace energymargin::search

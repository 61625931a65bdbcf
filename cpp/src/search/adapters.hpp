#pragma once
// The bounded problem as OMPL sees it. What is made here refers to the problem, which has to outlive it.

#include <ompl/base/ProblemDefinition.h>
#include <ompl/control/SpaceInformation.h>

#include <memory>

#include "search/wrench_space.hpp"

namespace energymargin::search {

class BoundedProblem;

//! The space of the controls' states: which of them are valid, and that a control leads to a node of the tree.
ompl::control::SpaceInformationPtr space_information(const std::shared_ptr<WrenchSpace>& controls,
                                                     BoundedProblem& problem);

//! The problem of a way from the root to an escape.
ompl::base::ProblemDefinitionPtr definition(const ompl::control::SpaceInformationPtr& si,
                                            const BoundedProblem& problem);

}  // namespace energymargin::search

#pragma once
// The barrier problem as OMPL sees it. What is made here refers to the problem, which has to outlive it.

#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>

namespace energymargin::quasistatic {

class BarrierProblem;

//! Poses in a box of half edge `reach` [m] around the start: which are allowed, which motions, and how they are drawn.
ompl::base::SpaceInformationPtr space_information(BarrierProblem& problem, double reach);

//! From the start to a pose outside of the capture set; the cost is the highest energy on the way [J].
ompl::base::ProblemDefinitionPtr definition(const ompl::base::SpaceInformationPtr& si, BarrierProblem& problem);

}  // namespace energymargin::quasistatic

#pragma once
// AO-x (Hauser and Zhou), Algorithm 1: a feasible planner x, asked again and again for a cheaper escape.

#include <ompl/base/Planner.h>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/escape.hpp"
#include "energymargin/search/shortening.hpp"

namespace energymargin::search {

//! Runs any OMPL control planner on the problem until its nodes are spent. The planner keeps its tree between
//! iterations, and prunes it if it is Prunable. With `shortening`, the planner and it take turns once there is an
//! escape; the planner's share of the nodes does not shrink, so AO-x stays asymptotically optimal.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening = nullptr);

}  // namespace energymargin::search

#pragma once
// AO-x (Hauser and Zhou), Algorithm 1: a feasible planner x, asked again and again for a cheaper escape.

#include <ompl/base/Planner.h>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/escape.hpp"
#include "search/shortening.hpp"

namespace energymargin::search {

//! When best escapes are played again in a finer simulation: one that does not lead out there is none, and does not
//! count.
enum class Confirm {
  best,       ///< the last one, and a few on the way; the search ends if one is none, since its cost bounded the search
  each_turn,  ///< after each turn of the planner and of shortening, before it bounds the search any longer
};

//! Runs any OMPL control planner on the problem until its nodes are spent. The planner keeps its tree between
//! iterations, and prunes it if it is Prunable. With `shortening`, the planner and it take turns once there is an
//! escape; the planner's share of the nodes does not shrink, so AO-x stays asymptotically optimal. With Confirm::best
//! it is to be done again with Confirm::each_turn if any escape was discarded.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening = nullptr,
          Confirm confirm = Confirm::each_turn);

}  // namespace energymargin::search

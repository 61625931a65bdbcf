#pragma once
// AO-x in turns with a local search.

#include <ompl/base/Planner.h>

#include "energymargin/search/bounded_problem.hpp"
#include "energymargin/search/escape.hpp"
#include "search/shortening.hpp"

namespace energymargin::search {

//! When best escapes are played again in a finer simulation. One that does not lead out there is no escape.
enum class Confirm {
  best,       ///< the last one, and a few on the way; the search ends if one is none, since its cost bounded the search
  each_turn,  ///< after each turn of the planner and of shortening, before it bounds the search any longer
};

//! As the function of two arguments. With `shortening`, unless it is null, a wait comes first, and then the planner and
//! it take turns: it guesses until there is an escape. The planner keeps a tenth of the nodes, with a clock half, so
//! AO-x stays asymptotically optimal. With Confirm::best it is to be done again with Confirm::each_turn if any escape
//! was discarded.
Escape ao(BoundedProblem& problem, ompl::base::Planner& planner, Shortening* shortening, Confirm confirm);

}  // namespace energymargin::search

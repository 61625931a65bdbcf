#pragma once
// BIT* (Gammell, Srinivasa and Barfoot), asked again for a lower barrier after each escape.

#include "quasistatic/barrier_problem.hpp"

namespace energymargin::quasistatic {

//! Runs until the problem's samples are spent. OMPL's own pruning stays off: with several goals it may drop the start
//! (its issue 949). Instead each run starts from the poses below the bound that the runs before it have drawn.
void bit_star(BarrierProblem& problem);

}  // namespace energymargin::quasistatic

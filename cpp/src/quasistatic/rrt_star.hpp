#pragma once
// RRT* (Karaman and Frazzoli), asked on for a lower barrier after each escape.

#include "quasistatic/barrier_problem.hpp"

namespace energymargin::quasistatic {

//! Runs until the problem's samples are spent. The tree stays, without what is not below the bound.
void rrt_star(BarrierProblem& problem);

}  // namespace energymargin::quasistatic

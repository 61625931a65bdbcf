#pragma once
// RRT* (Karaman and Frazzoli), asked on for a lower barrier after each way out.

#include "quasistatic/quasistatic_problem.hpp"

namespace energymargin::search {

//! Runs until the problem's samples are spent. The tree stays, without what is not below the bound.
void rrt_star(QuasistaticProblem& problem);

}  // namespace energymargin::search

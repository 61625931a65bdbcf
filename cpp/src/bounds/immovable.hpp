#pragma once
// Which bodies stay where they are, whatever happens.

#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin::bounds {

//! By body of the scene: fixed ones, those whose axes are all locked, and links that hang on them by joints that are
//! fixed or held. With a plan held joints may move.
std::vector<bool> immovable_bodies(const Problem& problem);

}  // namespace energymargin::bounds

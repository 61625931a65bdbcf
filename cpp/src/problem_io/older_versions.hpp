#pragma once
// What files of versions 3 to 5 say about the contact solver, which is another one since version 6.

#include <vector>

#include "energymargin/plausibility.hpp"
#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! Gives the scene of an older file the contact solver of today, and returns what scores may differ by. Leaves files of
//! version 6, and what is no problem file, as they are.
std::vector<Warning> update_scene(Json& file);

}  // namespace energymargin::problem_io

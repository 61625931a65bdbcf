#pragma once
// The two directions of a problem file.

#include <nlohmann/json.hpp>

#include "energymargin/problem.hpp"

namespace energymargin::problem_io {

using Json = nlohmann::ordered_json;

//! Throws std::invalid_argument for a region made of a user's own predicate.
Json write_problem(const Problem& problem);

//! Throws std::invalid_argument that names the place in the file and what was expected there.
Problem read_problem(const Json& json);

}  // namespace energymargin::problem_io

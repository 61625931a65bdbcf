#pragma once
// The two directions of a problem file.

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "energymargin/problem.hpp"

namespace energymargin::problem_io {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;  //!< keeps its keys in the order in which they were written

//! Files of the bodies whose compounds are not in the problem file itself, by the body's name.
using MeshFiles = std::map<std::string, std::string>;

//! Throws std::invalid_argument for a region made of a user's own predicate.
OrderedJson write_problem(const Problem& problem, const MeshFiles& meshes = {});

//! Mesh files are looked for in `folder`; empty: there is none. Throws std::invalid_argument that names the place in
//! the file and what was expected there.
Problem read_problem(const Json& json, const std::string& folder);

//! Rows are packed.
OrderedJson write(const Plan& plan);

//! A plan alone, which no scene is there for. Throws as `read_problem`.
Plan read_plan(const Json& json);

}  // namespace energymargin::problem_io

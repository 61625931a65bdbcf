#pragma once
// A Problem as a JSON file, and back. Numbers keep all their bits.

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

//! The version of the format that is written. Files from the oldest version on are read.
inline constexpr int problem_format_version = 6;
inline constexpr int oldest_problem_format_version = 3;

//! The JSON Schema (draft-07) of problem files, which every file is checked against when it is read.
const std::string& problem_schema();

//! The plans of policies by their names, since a file does not have their code.
using Policies = std::map<std::string, Plan>;

//! The problem as JSON text. Throws std::invalid_argument for a region made of a user's own predicate, and for a policy
//! without a name.
std::string to_json(const Problem& problem);

//! Reads and validates a problem; paths of meshes are relative to the folder. `warnings` gets what files of older
//! versions ask for in vain. Throws std::invalid_argument that names the place and what was expected, also where a
//! policy of the text is not among `policies`, or is another one there.
Problem from_json(const std::string& text, const std::string& folder = "", std::vector<Warning>* warnings = nullptr,
                  const Policies& policies = {});

//! The plan as JSON text, as it stands in a problem file. Throws std::invalid_argument if it is none.
std::string to_json(const Plan& plan);

//! Reads JSON text and validates the plan, as far as that needs no scene. Throws as `from_json`.
Plan plan_from_json(const std::string& text, const Policies& policies = {});

//! A file cannot be opened or written.
class FileError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

//! Where the points of compounds go that are hulls alone, unmoved, as those of a mesh.
enum class Meshes {
  embedded,  ///< into the problem file
  files,     ///< into OBJ files beside it: "push.json" with a body "cup" gets "push-cup.obj"
};

//! Writes atomically, the problem file last. Throws FileError if a file cannot be written.
void save(const Problem& problem, const std::string& path, Meshes meshes = Meshes::embedded);

//! Throws FileError if the file cannot be opened, else as from_json, naming it.
Problem load(const std::string& path, std::vector<Warning>* warnings = nullptr, const Policies& policies = {});

}  // namespace energymargin

#pragma once
// A Problem as a JSON file, and back. Numbers keep all their bits.

#include <stdexcept>
#include <string>

#include "energymargin/problem.hpp"

namespace energymargin {

//! Format version that `save` writes; `load` refuses newer ones.
inline constexpr int problem_format_version = 3;

//! The problem as JSON text. Throws std::invalid_argument for a region made of a user's own predicate.
std::string to_json(const Problem& problem);

//! Reads JSON text and validates the problem. Throws std::invalid_argument that names the place and what was expected.
Problem from_json(const std::string& text);

//! A file cannot be opened or written.
class FileError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

//! Writes atomically. Throws FileError if the file cannot be written.
void save(const Problem& problem, const std::string& path);

//! Throws FileError if the file cannot be opened, std::invalid_argument, naming it, if it is no problem file.
Problem load(const std::string& path);

}  // namespace energymargin

#pragma once
// JSON text, read with an eye on where it breaks.

#include <string>

#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! Throws std::invalid_argument that names the line and the place at which the text stops being JSON, and the place of
//! a number beyond all bounds, of a key that is given twice, and of nesting without end.
Json parse(const std::string& text, const std::string& what = "a problem");

}  // namespace energymargin::problem_io

#pragma once
// The JSON Schema that comes with the package, as other programs check a problem file by it.

#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! Throws std::invalid_argument that names the place if the file does not fit the schema.
void check_schema(const Json& json);

}  // namespace energymargin::problem_io

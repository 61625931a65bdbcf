#pragma once
// The definitions of the schema that follow from the description of fields.

#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! By name: of each struct that a problem file holds, and of the choice between shapes and between regions.
OrderedJson schema_definitions();

}  // namespace energymargin::problem_io

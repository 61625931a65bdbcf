#pragma once
// Rows of numbers as one text: base64 of their bits, eight bytes each, little-endian, row after row.

#include <string>

#include "energymargin/types.hpp"

namespace energymargin::problem_io {

std::string pack(const Wrenches& rows);

//! Rows of so many columns. Throws std::invalid_argument that says what was expected.
Wrenches unpack(const std::string& text, int columns);

}  // namespace energymargin::problem_io

#pragma once
// Compounds of convex hulls as OBJ files: one object for each part. Numbers keep all their bits.

#include <string>

#include "energymargin/shape.hpp"

namespace energymargin::problem_io {

//! Whether an OBJ file holds all that there is to the parts: hulls alone, none of them moved.
bool fits_mesh(const Compound& compound);

//! OBJ text with the points of each part, all of them, and faces for who looks at it.
std::string write_mesh(const Compound& compound);

//! The hulls of each object's points. Throws std::invalid_argument that names the line, or the part and its line.
Compound read_mesh(const std::string& text);

}  // namespace energymargin::problem_io

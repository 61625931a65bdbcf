#pragma once
// The parts of a problem file, each written by a file of its own.

#include <cmath>

#include "problem_io/json.hpp"

namespace energymargin::problem_io {

inline OrderedJson write(const Vector2& v) { return {v.x(), v.y()}; }
inline OrderedJson write(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
inline OrderedJson write(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

//! JSON has no infinity; a size without limit is the word.
inline OrderedJson write_size(double value) {
  if (!std::isinf(value)) return value;
  return value > 0.0 ? "inf" : "-inf";
}

OrderedJson write(const Shape& shape);

//! A compound whose parts are in a file.
OrderedJson write_mesh_shape(const Compound& compound, const std::string& file);

//! Throws std::invalid_argument for a region made of a user's own predicate.
OrderedJson write(const Region& region);

}  // namespace energymargin::problem_io

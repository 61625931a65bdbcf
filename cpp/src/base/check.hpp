#pragma once
// Validation of arguments: an error names the argument, the value and what was expected. And what angles are made of.

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

#include "energymargin/types.hpp"

namespace energymargin {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double full_turn = 2.0 * pi;  // [rad]

inline std::string text(const Vector3& v) {
  std::ostringstream out;
  out << "(" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return out.str();
}

inline std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

[[noreturn]] inline void reject(const std::string& argument, const std::string& value, const std::string& expected) {
  throw std::invalid_argument(argument + " is " + value + ", expected " + expected);
}

inline void require_finite(const std::string& argument, double value) {
  if (!std::isfinite(value)) reject(argument, text(value), "a finite number");
}

inline void require_finite(const std::string& argument, const Vector3& value) {
  if (!value.allFinite()) reject(argument, text(value), "finite numbers");
}

inline void require_positive(const std::string& argument, double value) {
  if (!(std::isfinite(value) && value > 0.0)) reject(argument, text(value), "a finite number above 0");
}

inline void require_not_negative(const std::string& argument, double value) {
  if (!(std::isfinite(value) && value >= 0.0)) reject(argument, text(value), "a finite number of at least 0");
}

inline void require_unit(const std::string& argument, const Vector3& value) {
  if (!(std::abs(value.norm() - 1.0) < 1e-6)) reject(argument, text(value), "a vector of length 1");
}

inline void require_unit(const std::string& argument, const Quaternion& value) {
  if (std::abs(value.norm() - 1.0) < 1e-6) return;
  const std::string vector = text(value.vec());
  reject(argument, vector.substr(0, vector.size() - 1) + ", " + text(value.w()) + ")",
         "a unit quaternion (x, y, z, w)");
}

inline void require_at_least(const std::string& argument, long long value, long long least) {
  if (value < least) reject(argument, std::to_string(value), "a whole number of at least " + std::to_string(least));
}

//! What `check` gives; its errors say where they are of first.
template <typename Check>
auto at_place(const std::string& where, const Check& check) {
  try {
    return check();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(where + error.what());
  }
}

}  // namespace energymargin

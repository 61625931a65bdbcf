#pragma once
// Functions with the same bits on every x86-64 processor. A C library has several of each and takes the one of the
// processor's extensions; their last bits differ, in one call of a thousand. Those of longer numbers it has once, and
// the double next to such a result is nearly always the one next to the true value.

#include <algorithm>
#include <cmath>
#include <limits>

#include "energymargin/types.hpp"

namespace energymargin::portable {

inline double sin(double x) { return static_cast<double>(std::sin(static_cast<long double>(x))); }
inline double cos(double x) { return static_cast<double>(std::cos(static_cast<long double>(x))); }
inline double tan(double x) { return static_cast<double>(std::tan(static_cast<long double>(x))); }
inline double asin(double x) { return static_cast<double>(std::asin(static_cast<long double>(x))); }
inline double acos(double x) { return static_cast<double>(std::acos(static_cast<long double>(x))); }
inline double atan(double x) { return static_cast<double>(std::atan(static_cast<long double>(x))); }
inline double exp(double x) { return static_cast<double>(std::exp(static_cast<long double>(x))); }
inline double log(double x) { return static_cast<double>(std::log(static_cast<long double>(x))); }
inline double log1p(double x) { return static_cast<double>(std::log1p(static_cast<long double>(x))); }
inline double asinh(double x) { return static_cast<double>(std::asinh(static_cast<long double>(x))); }

inline double atan2(double y, double x) {
  return static_cast<double>(std::atan2(static_cast<long double>(y), static_cast<long double>(x)));
}

inline double pow(double base, double exponent) {
  return static_cast<double>(std::pow(static_cast<long double>(base), static_cast<long double>(exponent)));
}

//! A turn about an axis of length 1, by an angle [rad].
inline Quaternion turn(double angle, const Vector3& axis) {
  const Vector3 vector = sin(0.5 * angle) * axis;
  return {cos(0.5 * angle), vector.x(), vector.y(), vector.z()};
}

//! The rotation vector of a turn, at most half of one [rad].
inline Vector3 rotation_vector(const Quaternion& turn) {
  double sine = turn.vec().norm();
  if (sine < std::numeric_limits<double>::epsilon()) sine = turn.vec().stableNorm();
  if (sine == 0.0) return Vector3::Zero();
  const double angle = 2.0 * atan2(sine, std::abs(turn.w()));
  return angle * Vector3(turn.vec() / (turn.w() < 0.0 ? -sine : sine));
}

//! The turn after a share of the way from one to another one (Shoemake 1985).
inline Quaternion slerp(const Quaternion& from, double share, const Quaternion& to) {
  const double cosine = from.dot(to), turn = acos(std::min(1.0, std::abs(cosine)));
  const bool near = std::abs(cosine) >= 1.0 - std::numeric_limits<double>::epsilon();
  const double first = near ? 1.0 - share : sin((1.0 - share) * turn) / sin(turn);
  const double second = near ? share : sin(share * turn) / sin(turn);
  return Quaternion(first * from.coeffs() + (cosine < 0.0 ? -second : second) * to.coeffs());
}

}  // namespace energymargin::portable

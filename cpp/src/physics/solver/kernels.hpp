#pragma once
// Sums over the rows of Jacobians. Most movers are free bodies, for which loops of a known length are twice as fast.

#include <cmath>
#include <cstddef>

#include "physics/solver/envelope_lu.hpp"
#include "physics/solver/friction_law.hpp"

namespace energymargin {

inline double dot(const double* a, const double* b, int count) {
  if (count == usual_count) {
    return ((a[0] * b[0] + a[2] * b[2]) + a[4] * b[4]) + ((a[1] * b[1] + a[3] * b[3]) + a[5] * b[5]);
  }
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

//! entries += factor * row
inline void add_multiple(double factor, const double* __restrict row, int count, double* __restrict entries) {
  if (count == usual_count) {
    for (int j = 0; j < usual_count; ++j) entries[j] += factor * row[j];
    return;
  }
  for (int j = 0; j < count; ++j) entries[j] += factor * row[j];
}

//! Speeds along the rows.
inline void add_speeds(const double* jacobian, const double* velocities, ContactVector& speeds) {
  for (std::size_t row = 0; row < 3; ++row) speeds[row] += dot(jacobian + row * usual_count, velocities, usual_count);
}

//! Impulses along the rows.
inline void take_contact(const double* __restrict jacobian, const double* __restrict impulse,
                         double* __restrict residual, double* __restrict turnover) {
  for (int j = 0; j < usual_count; ++j) {
    const double sum =
        impulse[0] * jacobian[j] + impulse[1] * jacobian[usual_count + j] + impulse[2] * jacobian[2 * usual_count + j];
    residual[j] -= sum;
    turnover[j] += std::abs(sum);
  }
}

//! slope x rows of `count` velocities: nothing that friction does presses.
[[gnu::always_inline]] inline void answer_contact(const ContactResponse& response, const double* __restrict rows,
                                                  int count, double* __restrict answer) {
  const ContactVector &x = response.slope[0], &y = response.slope[1], &normal = response.slope[2];
  if (response.regime == Regime::sticks) {
    for (int j = 0; j < count; ++j) {
      answer[j] = x[0] * rows[j];
      answer[count + j] = y[1] * rows[count + j];
      answer[2 * count + j] = normal[2] * rows[2 * count + j];
    }
    return;
  }
  for (int j = 0; j < count; ++j) {
    const double along_x = rows[j], along_y = rows[count + j], along_normal = rows[2 * count + j];
    answer[j] = x[0] * along_x + x[1] * along_y + x[2] * along_normal;
    answer[count + j] = y[0] * along_x + y[1] * along_y + y[2] * along_normal;
    answer[2 * count + j] = normal[2] * along_normal;
  }
}

//! entries += column' x rows of `count` velocities; `step` is the number of columns.
[[gnu::always_inline]] inline void add_contact_row(const double* __restrict column, int step,
                                                   const double* __restrict rows, int count,
                                                   double* __restrict entries) {
  const double x = column[0], y = column[step], normal = column[2 * step];
  for (int j = 0; j < count; ++j) entries[j] += x * rows[j] + y * rows[count + j] + normal * rows[2 * count + j];
}

}  // namespace energymargin

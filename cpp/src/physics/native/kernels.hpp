#pragma once
// Sums over the rows of Jacobians. Most movers are free bodies, for which loops of a known length are twice as fast.

#include <cmath>
#include <cstddef>
#include <cstring>

#include "base/pair.hpp"
#include "physics/native/envelope_lu.hpp"
#include "physics/native/friction_law.hpp"

namespace energymargin {

inline double usual_dot(const double* a, const double* b) {
  const Pair sums = (pair(a) * pair(b) + pair(a + 2) * pair(b + 2)) + pair(a + 4) * pair(b + 4);
  return sums[0] + sums[1];
}

inline double dot(const double* a, const double* b, int count) {
  if (count == usual_count) return usual_dot(a, b);
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
  for (std::size_t row = 0; row < 3; ++row) speeds[row] += usual_dot(jacobian + row * usual_count, velocities);
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

//! entries += columns' x rows: a block of a matrix whose rows are `stride` apart. `columns` and `rows` are three rows
//! of as many velocities as the block has rows and columns.
inline void add_contact_block(const double* __restrict columns, int of_columns, const double* __restrict rows,
                              int of_rows, double* __restrict entries, std::ptrdiff_t stride) {
  for (int i = 0; i < of_columns; ++i) {
    const double x = columns[i], y = columns[of_columns + i], normal = columns[2 * of_columns + i];
    double* const of_row = entries + i * stride;
    for (int j = 0; j < of_rows; ++j) of_row[j] += x * rows[j] + y * rows[of_rows + j] + normal * rows[2 * of_rows + j];
  }
}

//! The same of two free bodies.
inline void add_usual_block(const double* columns, const double* rows, double* entries, std::ptrdiff_t stride) {
  constexpr int pairs = usual_count / 2;
  Pair x[pairs], y[pairs], normal[pairs];
  for (int k = 0; k < pairs; ++k) {
    x[k] = pair(rows + 2 * k);
    y[k] = pair(rows + usual_count + 2 * k);
    normal[k] = pair(rows + 2 * usual_count + 2 * k);
  }
  for (int i = 0; i < usual_count; ++i, entries += stride) {
    for (int k = 0; k < pairs; ++k) {
      const Pair sums = pair(entries + 2 * k) + ((columns[i] * x[k] + columns[usual_count + i] * y[k]) +
                                                 columns[2 * usual_count + i] * normal[k]);
      std::memcpy(entries + 2 * k, &sums, sizeof sums);
    }
  }
}

}  // namespace energymargin

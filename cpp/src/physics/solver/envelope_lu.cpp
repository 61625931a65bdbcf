#include "physics/solver/envelope_lu.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace energymargin {
namespace {

// A pivot that is less than this share of what it was before the elimination is rounding error.
constexpr double least_pivot = 1e-13;

// Subtracts multiples of some rows from another one, one after the other, from a column on.
template <int Rows>
void eliminate(const double* __restrict factors, const double* const* rows, int first, int last,
               double* __restrict entries) {
  for (int j = first; j <= last; ++j) {
    double entry = entries[j];
    for (int k = 0; k < Rows; ++k) entry -= factors[k] * rows[k][j];
    entries[j] = entry;
  }
}

}  // namespace

void EnvelopeLu::reset(const std::vector<int>& first) {
  const auto count = first.size();
  first_ = first;
  last_.resize(count);
  begins_.resize(count);
  starts_.assign(count, false);
  for (std::size_t i = 0; i < count; ++i) last_[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < count; ++i) {
    const auto column = static_cast<std::size_t>(first[i]);
    last_[column] = std::max(last_[column], static_cast<int>(i));
    starts_[column] = true;
  }
  std::ptrdiff_t size = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) last_[i] = std::max(last_[i], last_[i - 1]);
    begins_[i] = size - first[i];
    size += last_[i] - first[i] + 1;
  }
  values_.assign(static_cast<std::size_t>(size), 0.0);
}

// By blocks of rows with one envelope, so that what is below is read once for a block. Each entry sees the pivots in
// their order.
bool EnvelopeLu::factor() {
  const int count = static_cast<int>(first_.size());
  inverses_.resize(first_.size());
  if (count == usual_count && first_.back() == 0) return factor_usual();
  for (int begin = 0; begin < count;) {
    const int end = end_of_block(begin);
    const int last = last_[static_cast<std::size_t>(begin)];
    for (int i = begin; i <= last; ++i) {
      if (first_[static_cast<std::size_t>(i)] > begin) continue;
      if (!eliminate_block(begin, std::min(i, end), last, i)) return false;
      if (i < end && !invert_pivot(i)) return false;
    }
    begin = end;
  }
  return true;
}

// Where the next block begins.
int EnvelopeLu::end_of_block(int begin) const {
  int end = begin + 1;
  while (end < static_cast<int>(first_.size()) && end < begin + usual_count &&
         !starts_[static_cast<std::size_t>(end)] &&
         last_[static_cast<std::size_t>(end)] == last_[static_cast<std::size_t>(begin)]) {
    ++end;
  }
  return end;
}

// Eliminates the columns begin .. end - 1 of row i.
bool EnvelopeLu::eliminate_block(int begin, int end, int last, int i) {
  double* const entries = row(i);
  double factors[usual_count];
  const double* rows[usual_count];
  double diagonal = entries[i];
  for (int k = begin; k < end; ++k) {
    const double* const pivots = rows[k - begin] = row(k);
    const double factor = factors[k - begin] = entries[k] * inverses_[static_cast<std::size_t>(k)];
    entries[k] = factor;
    if (factor == 0.0) continue;
    for (int j = k + 1; j < end; ++j) entries[j] -= factor * pivots[j];
    const double before = std::abs(diagonal);
    diagonal -= factor * pivots[i];
    if (std::abs(diagonal) < least_pivot * before) return false;
  }
  const auto eliminate_rows = std::array{&eliminate<0>, &eliminate<1>, &eliminate<2>, &eliminate<3>,
                                         &eliminate<4>, &eliminate<5>, &eliminate<6>};
  eliminate_rows[static_cast<std::size_t>(end - begin)](factors, rows, end, last, entries);
  return true;
}

bool EnvelopeLu::invert_pivot(int i) {
  const double pivot = row(i)[i];
  inverses_[static_cast<std::size_t>(i)] = 1.0 / pivot;
  return std::abs(pivot) > std::numeric_limits<double>::min();
}

bool EnvelopeLu::factor_usual() {
  double* const values = values_.data();
  for (int k = 0; k < usual_count; ++k) {
    const double* const pivots = values + k * usual_count;
    if (!(std::abs(pivots[k]) > std::numeric_limits<double>::min())) return false;
    const double inverse = inverses_[static_cast<std::size_t>(k)] = 1.0 / pivots[k];
    for (int i = k + 1; i < usual_count; ++i) {
      double* const entries = values + i * usual_count;
      const double factor = entries[k] * inverse;
      const double before = std::abs(entries[i]);
      for (int j = k + 1; j < usual_count; ++j) entries[j] -= factor * pivots[j];
      entries[k] = factor;
      if (std::abs(entries[i]) < least_pivot * before) return false;
    }
  }
  return true;
}

void EnvelopeLu::solve(double* x) const {
  const int count = static_cast<int>(first_.size());
  for (int i = 1; i < count; ++i) {
    const double* const entries = row(i);
    double sum = x[i];
    for (int j = first_[static_cast<std::size_t>(i)]; j < i; ++j) sum -= entries[j] * x[j];
    x[i] = sum;
  }
  for (int i = count - 1; i >= 0; --i) {
    const double* const entries = row(i);
    double sum = x[i];
    for (int j = i + 1; j <= last_[static_cast<std::size_t>(i)]; ++j) sum -= entries[j] * x[j];
    x[i] = sum * inverses_[static_cast<std::size_t>(i)];
  }
}

}  // namespace energymargin

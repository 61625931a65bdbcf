#include "physics/solver/envelope_lu.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace energymargin {
namespace {

// A pivot that is less than this share of what it was before the elimination is rounding error.
constexpr double least_pivot = 1e-13;

// entries -= factor * pivots, from column k on
void eliminate(double factor, const double* __restrict pivots, int k, int last, double* __restrict entries) {
  for (int j = k; j <= last; ++j) entries[j] -= factor * pivots[j];
}

}  // namespace

void EnvelopeLu::reset(const std::vector<int>& first) {
  const auto count = first.size();
  first_ = first;
  last_.resize(count);
  begins_.resize(count);
  for (std::size_t i = 0; i < count; ++i) last_[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < count; ++i) {
    const auto column = static_cast<std::size_t>(first[i]);
    last_[column] = std::max(last_[column], static_cast<int>(i));
  }
  std::ptrdiff_t size = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) last_[i] = std::max(last_[i], last_[i - 1]);
    begins_[i] = size - first[i];
    size += last_[i] - first[i] + 1;
  }
  values_.assign(static_cast<std::size_t>(size), 0.0);
}

bool EnvelopeLu::factor() {
  const int count = static_cast<int>(first_.size());
  inverses_.resize(first_.size());
  if (count == usual_count && first_.back() == 0) return factor_usual();
  for (int k = 0; k < count; ++k) {
    const double* const pivots = row(k);
    if (!(std::abs(pivots[k]) > std::numeric_limits<double>::min())) return false;
    const double inverse = inverses_[static_cast<std::size_t>(k)] = 1.0 / pivots[k];
    const int last = last_[static_cast<std::size_t>(k)];
    for (int i = k + 1; i <= last; ++i) {
      if (first_[static_cast<std::size_t>(i)] > k) continue;
      double* const entries = row(i);
      if (entries[k] == 0.0) continue;
      const double factor = entries[k] * inverse;
      const double before = std::abs(entries[i]);
      entries[k] = factor;
      eliminate(factor, pivots, k + 1, last, entries);
      if (std::abs(entries[i]) < least_pivot * before) return false;
    }
  }
  return true;
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

#include "physics/native/envelope_lu.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace energymargin {
namespace {

// A pivot that is less than this share of what it was before the elimination is rounding error.
constexpr double least_pivot = 1e-13;

// Calls visit(count) with the count as a std::integral_constant, so that loops have a known length.
template <typename Visit, int... Counts>
bool with_constant(int count, std::integer_sequence<int, Counts...>, const Visit& visit) {
  return ((count == Counts && visit(std::integral_constant<int, Counts>())) || ...);
}

// Subtracts multiples of `Count` rows of pivots from a row below them, one after the other, and puts the factors in the
// place of its entries there. False if one of them cancels its diagonal.
template <int Count>
bool eliminate(const double* const* pivots, const double* inverses, int begin, int last, int i,
               double* __restrict entries) {
  double factors[Count + 1];  // of no rows there is one too
  std::copy_n(entries + begin, Count, factors);
  double diagonal = entries[i];
  bool cancelled = false;
#pragma GCC unroll 8
  for (int k = 0; k < Count; ++k) {
    factors[k] *= inverses[k];
#pragma GCC unroll 8
    for (int j = k + 1; j < Count; ++j) factors[j] -= factors[k] * pivots[k][begin + j];
    const double before = std::abs(diagonal);
    diagonal -= factors[k] * pivots[k][i];
    cancelled |= std::abs(diagonal) < least_pivot * before;
  }
  std::copy_n(factors, Count, entries + begin);
  for (int j = begin + Count; j <= last; ++j) {
    double entry = entries[j];
    for (int k = 0; k < Count; ++k) entry -= factors[k] * pivots[k][j];
    entries[j] = entry;
  }
  return !cancelled;
}

}  // namespace

void EnvelopeLu::reset(const std::vector<int>& first) {
  if (first != first_) set_pattern(first);
  std::fill(values_.begin(), values_.end(), 0.0);
}

void EnvelopeLu::set_pattern(const std::vector<int>& first) {
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
  values_.resize(static_cast<std::size_t>(size));
}

// By blocks of rows with one envelope, so that what is below is read once for a block. Each entry sees the pivots in
// their order.
bool EnvelopeLu::factor() {
  const int count = static_cast<int>(first_.size());
  inverses_.resize(first_.size());
  for (int begin = 0; begin < count;) {
    const int end = end_of_block(begin);
    const auto factor = [&](auto rows) { return factor_block(begin, std::make_integer_sequence<int, rows()>()); };
    if (!with_constant(end - begin, std::integer_sequence<int, 1, 2, 3, 4, 5, usual_count>(), factor)) return false;
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

template <int... Rows>
bool EnvelopeLu::factor_block(int begin, std::integer_sequence<int, Rows...>) {
  constexpr int count = sizeof...(Rows);
  const int last = last_[static_cast<std::size_t>(begin)];
  const double* const pivots[] = {row(begin + Rows)...};
  double* const inverses = inverses_.data() + begin;
  const auto factor_row = [&](auto k) {
    const int i = begin + k();
    double* const entries = row(i);
    if (!eliminate<k()>(pivots, inverses, begin, last, i, entries)) return false;
    inverses[k()] = 1.0 / entries[i];
    return std::abs(entries[i]) > std::numeric_limits<double>::min();
  };
  if (!(factor_row(std::integral_constant<int, Rows>()) && ...)) return false;
  for (int i = begin + count; i <= last; ++i) {
    if (first_[static_cast<std::size_t>(i)] > begin) continue;
    if (!eliminate<count>(pivots, inverses, begin, last, i, row(i))) return false;
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

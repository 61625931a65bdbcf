#include "search/cell_weights.hpp"

namespace energymargin::search {
namespace {

// How many weights are in the i-th sum.
std::size_t width(std::size_t i) { return i & (~i + 1); }

}  // namespace

void CellWeights::add(double weight) {
  const std::size_t i = sums_.size() + 1;
  for (std::size_t part = 1; part < width(i); part *= 2) weight += sums_[i - part - 1];
  sums_.push_back(weight);
}

void CellWeights::change(std::size_t index, double difference) {
  for (std::size_t i = index + 1; i <= sums_.size(); i += width(i)) sums_[i - 1] += difference;
}

std::size_t CellWeights::at(double share) const {
  double left = share * sum(sums_.size());
  std::size_t step = 1;
  while (2 * step <= sums_.size()) step *= 2;
  std::size_t before = 0;
  // The last one takes what rounding leaves.
  for (; step > 0; step /= 2) {
    const std::size_t i = before + step;
    if (i >= sums_.size() || left <= sums_[i - 1]) continue;
    left -= sums_[i - 1];
    before = i;
  }
  return before;
}

// Of the first ones.
double CellWeights::sum(std::size_t count) const {
  double sum = 0.0;
  for (std::size_t i = count; i > 0; i -= width(i)) sum += sums_[i - 1];
  return sum;
}

}  // namespace energymargin::search

#include "physics/contacts/near_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace energymargin {
namespace {

constexpr double rounding_of_ends = 1e-12;  // of an interval's ends, a share of them
constexpr double infinity = std::numeric_limits<double>::infinity();

int widest_axis(const std::vector<Bounds>& boxes) {
  btVector3 sum(0, 0, 0);
  btVector3 squares(0, 0, 0);
  for (const Bounds& box : boxes) {
    const btVector3 center = 0.5 * (box.low + box.high);
    sum += center;
    squares += center * center;
  }
  return (squares - sum * sum / static_cast<double>(boxes.size())).maxAxis();
}

struct Interval {  // with the box's reach on both sides
  double low, high;
  std::size_t box;
};

std::vector<Interval> sorted_intervals(const std::vector<Bounds>& boxes, const std::vector<double>& reaches) {
  const int axis = widest_axis(boxes);
  std::vector<Interval> intervals;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double low = boxes[i].low[axis];
    const double high = boxes[i].high[axis];
    const double reach = reaches[i] + rounding_of_ends * (std::abs(low) + std::abs(high));
    // What diverges is not a number, which has no place in an order.
    const bool known = !std::isnan(low - reach) && !std::isnan(high + reach);
    intervals.push_back({known ? low - reach : -infinity, known ? high + reach : infinity, i});
  }
  std::sort(intervals.begin(), intervals.end(), [](const Interval& a, const Interval& b) { return a.low < b.low; });
  return intervals;
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> near_pairs(const std::vector<Bounds>& boxes,
                                                            const std::vector<double>& reaches) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const std::vector<Interval> intervals = sorted_intervals(boxes, reaches);
  for (auto one = intervals.begin(); one != intervals.end(); ++one) {
    for (auto other = one + 1; other != intervals.end() && other->low <= one->high; ++other) {
      const auto [a, b] = std::minmax(one->box, other->box);
      if (gap_of(boxes[a], boxes[b]) <= reaches[a] + reaches[b]) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

}  // namespace energymargin

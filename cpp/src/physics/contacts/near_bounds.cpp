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
    const btVector3 center = box.center();
    sum += center;
    squares += center * center;
  }
  return (squares - sum * sum / static_cast<double>(boxes.size())).maxAxis();
}

}  // namespace

void SweepAndPrune::sort(const std::vector<Bounds>& boxes, const std::vector<double>& reaches) {
  const int axis = widest_axis(boxes);
  intervals_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double low = boxes[i].low[axis];
    const double high = boxes[i].high[axis];
    const double reach = reaches[i] + rounding_of_ends * (std::abs(low) + std::abs(high));
    // What diverges is not a number, which has no place in an order.
    const bool known = !std::isnan(low - reach) && !std::isnan(high + reach);
    intervals_.push_back({known ? low - reach : -infinity, known ? high + reach : infinity, i});
  }
  std::sort(intervals_.begin(), intervals_.end(), [](const Interval& a, const Interval& b) { return a.low < b.low; });
}

}  // namespace energymargin

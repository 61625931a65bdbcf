#pragma once
// Which boxes of bounds are near each other.

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <vector>

namespace energymargin {

//! An axis-aligned box [m].
struct Bounds {
  btVector3 low, high;

  btVector3 center() const { return 0.5 * (low + high); }
};

//! Distance along the axis that separates two boxes most; negative where they overlap [m].
inline double gap_of(const Bounds& a, const Bounds& b) {
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

//! Sweep and prune (Baraff 1992) along the axis on which the boxes lie farthest apart. It starts anew each time: what
//! it finds is a function of its arguments, and sorting a thousand boxes takes 1 % of a step of them.
class SweepAndPrune {
 public:
  //! Calls visit(a, b), a < b, in no order, for all pairs whose gap is at most the sum of their `reaches` [m].
  template <typename Visit>
  void operator()(const std::vector<Bounds>& boxes, const std::vector<double>& reaches, const Visit& visit) {
    sort(boxes, reaches);
    for (std::size_t i = 0; i < intervals_.size(); ++i) {
      for (std::size_t j = i + 1; j < intervals_.size() && intervals_[j].low <= intervals_[i].high; ++j) {
        const auto [a, b] = std::minmax(intervals_[i].box, intervals_[j].box);
        if (gap_of(boxes[a], boxes[b]) <= reaches[a] + reaches[b]) visit(a, b);
      }
    }
  }

 private:
  struct Interval {  // with the box's reach on both sides
    double low, high;
    std::size_t box;
  };

  void sort(const std::vector<Bounds>& boxes, const std::vector<double>& reaches);

  std::vector<Interval> intervals_;
};

}  // namespace energymargin

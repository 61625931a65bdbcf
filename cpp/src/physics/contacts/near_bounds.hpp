#pragma once
// Which boxes of bounds are near each other.

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace energymargin {

//! An axis-aligned box [m].
struct Bounds {
  btVector3 low, high;
};

inline Bounds bounds_of(const btCollisionShape& shape, const btTransform& pose) {
  Bounds bounds;
  shape.getAabb(pose, bounds.low, bounds.high);
  return bounds;
}

//! Distance along the axis that separates two boxes most; negative where they penetrate each other [m].
inline double gap_of(const Bounds& a, const Bounds& b) {
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

//! All pairs (a, b), a < b, in no order, whose gap is at most the sum of their `reaches` [m]: sweep and prune (Baraff
//! 1992) along the axis on which the boxes lie farthest apart. It starts anew each time, as sorting a thousand boxes
//! takes 1 % of a step of them.
std::vector<std::pair<std::size_t, std::size_t>> near_pairs(const std::vector<Bounds>& boxes,
                                                            const std::vector<double>& reaches);

}  // namespace energymargin

#include "quasistatic/path.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin::quasistatic {

Pose interpolate(const Pose& from, const Pose& to, double t) {
  return {(1.0 - t) * from.position + t * to.position, from.orientation.slerp(t, to.orientation).normalized()};
}

double angle(const Quaternion& a, const Quaternion& b) { return 2.0 * std::acos(std::min(1.0, std::abs(a.dot(b)))); }

}  // namespace energymargin::quasistatic

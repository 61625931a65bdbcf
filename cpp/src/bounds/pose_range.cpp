#include "bounds/pose_range.hpp"

#include <algorithm>
#include <cmath>

#include "base/angles.hpp"

namespace energymargin::bounds {
namespace {

constexpr double slack_share = 1e-9;  // of distances and angles: a share of their size, or rad

}  // namespace

Range distance(const PoseRange& at, const Vector3& center, int axes) {
  Eigen::VectorXd far = (at.position - center).cwiseAbs().head(axes) + at.slack.head(axes);
  Eigen::VectorXd near = ((at.position - center).cwiseAbs().head(axes) - at.slack.head(axes)).cwiseMax(0.0);
  return {near.norm(), far.norm()};
}

CrossingEnergy at_most(double limit, double low, double high) {
  const double slack = slack_share * (std::abs(limit) + std::abs(low) + std::abs(high));
  if (high + slack <= limit) return surely_inside;
  return low - slack > limit ? surely_outside : either;
}

CrossingEnergy both(const CrossingEnergy& a, const CrossingEnergy& b) {
  return {std::min(a.outside, b.outside), std::max(a.inside, b.inside)};
}

CrossingEnergy in_sector(const regions::AnnularSector& sector, const PoseRange& at) {
  const Vector3 center(sector.center.x(), sector.center.y(), 0.0);
  const Range arm = distance(at, center, 2);
  const CrossingEnergy ring = both(at_most(sector.radius + sector.half_width, arm.low, arm.high),
                                   at_most(sector.half_width - sector.radius, -arm.high, -arm.low));
  const double sweep = std::abs(sector.sweep);
  if (sweep >= full_turn) return ring;
  const Vector2 middle = at.position.head<2>() - sector.center;
  const double slack = at.slack.head<2>().norm();
  if (slack >= middle.norm()) return both(ring, either);
  const double spread = std::asin(slack / middle.norm()) + slack_share;
  const double turned = (sector.sweep < 0.0 ? -1.0 : 1.0) * (std::atan2(middle.y(), middle.x()) - sector.start_angle);
  const double angle = turned - full_turn * std::floor(turned / full_turn);
  if (angle - spread >= 0.0 && angle + spread <= sweep) return ring;
  const bool out = angle - spread > sweep && angle + spread < full_turn;
  return both(ring, out ? surely_outside : either);
}

}  // namespace energymargin::bounds

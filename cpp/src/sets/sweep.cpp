#include "sets/sweep.hpp"

#include <algorithm>
#include <cmath>

#include "base/angles.hpp"

namespace energymargin {
namespace {

constexpr double straight = 1000.0;  // radius from which on a path counts as straight [m]

}  // namespace

regions::PlanarMotion planar_motion(const BodyState& body) {
  return {body.position.head<2>(), body.velocity.head<2>(), body.angular_velocity.z()};
}

std::optional<regions::AnnularSector> swept_sector(const regions::Swept& swept, const regions::PlanarMotion& motion) {
  const double speed = motion.velocity.norm();
  if (speed < swept.least_speed || speed == 0.0) return std::nullopt;
  const double turn = motion.yaw_rate < 0.0 ? -1.0 : 1.0;  // 1: the centre is on the left of the motion
  const double radius = speed / std::max(std::abs(motion.yaw_rate), speed / straight);
  const Vector2 outwards = turn / speed * Vector2(motion.velocity.y(), -motion.velocity.x());
  regions::AnnularSector sector;
  sector.center = motion.position - radius * outwards;
  sector.radius = radius;
  sector.half_width = swept.half_width;
  sector.start_angle = std::atan2(outwards.y(), outwards.x()) - turn * swept.behind / radius;
  sector.sweep = turn * std::min((swept.behind + swept.ahead * speed + swept.beyond) / radius, full_turn);
  return sector;
}

}  // namespace energymargin

#include "sets/body_reader.hpp"

#include <algorithm>
#include <cmath>

#include "base/angles.hpp"
#include "base/check.hpp"

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

Vector3 position_in_body(const Scene& scene, const std::string& name, regions::Point point) {
  if (point == regions::Point::origin) return Vector3::Zero();
  const std::size_t body = scene.index(name);
  if (scene.bodies()[body].fixed()) reject("point", "'center_of_mass' of '" + name + "', which is fixed", "'origin'");
  return scene.inertial(body).center;
}

Vector3 BodyReader::position(const double* state) const {
  const Vector3 position = state_at_point(point_, (*kinematics_)(state, body_)).position;
  if (in_world_) return position;
  const BodyState frame = other(state);
  return frame.orientation.conjugate() * (position - frame.position);
}

Vector3 BodyReader::frame_velocity(const double* state) const {
  const BodyState frame = other(state);
  return frame.orientation.conjugate() * frame.velocity;
}

Vector3 BodyReader::direction(const double* state, const Vector3& axis) const {
  const Vector3 direction = (*kinematics_)(state, body_).orientation * axis;
  return in_world_ ? direction : Vector3(other(state).orientation.conjugate() * direction);
}

Vector3 BodyReader::velocity(const double* state, const regions::Speed& speed) const {
  const BodyState body = (*kinematics_)(state, body_);
  const Vector3 arm = speed.along_world ? speed.point : Vector3(body.orientation * speed.point);
  const Vector3 velocity = body.velocity + body.angular_velocity.cross(arm);
  if (in_world_) return velocity;
  const BodyState frame = other(state);
  const Vector3 velocity_of_frame = frame.velocity + frame.angular_velocity.cross(body.position + arm - frame.position);
  return frame.orientation.conjugate() * (velocity - velocity_of_frame);
}

}  // namespace energymargin

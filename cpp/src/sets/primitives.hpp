#pragma once
// What each primitive region reads of a state vector, and how far that is beyond its edge.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/region.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! How a body moves in x and y.
inline regions::PlanarMotion planar_motion(const BodyState& body) {
  return {body.position.head<2>(), body.velocity.head<2>(), body.angular_velocity.z()};
}

//! The annular sector about the instantaneous centre of rotation; none while the body is too slow: then it is the disc.
inline std::optional<regions::AnnularSector> swept_sector(const regions::Swept& swept,
                                                          const regions::PlanarMotion& motion) {
  constexpr double straight = 1000.0;  // radius from which on a path counts as straight [m]
  const double speed = motion.velocity.norm();
  if (speed < swept.least_speed || speed == 0.0) return std::nullopt;
  const double turn = motion.yaw_rate < 0.0 ? -1.0 : 1.0;  // 1: the centre is on the left of the motion
  const double radius = speed / std::max(std::abs(motion.yaw_rate), speed / straight);
  const Vector2 outwards = turn / speed * Vector2(motion.velocity.y(), -motion.velocity.x());
  regions::AnnularSector sector;
  sector.center = motion.position - radius * outwards;
  sector.radius = radius;
  sector.half_width = swept.half_width;
  sector.start_angle = portable::atan2(outwards.y(), outwards.x()) - turn * swept.behind / radius;
  sector.sweep = turn * std::min((swept.behind + swept.ahead * speed + swept.beyond) / radius, full_turn);
  return sector;
}

//! Where a point of a body is, in the body's frame [m]. Throws on the centre of mass of a fixed body, which has none.
inline Vector3 position_in_body(const Scene& scene, const std::string& name, regions::Point point) {
  if (point == regions::Point::origin) return Vector3::Zero();
  const std::size_t body = scene.index(name);
  if (scene.bodies()[body].fixed()) reject("point", "'center_of_mass' of '" + name + "', which is fixed", "'origin'");
  return scene.inertial(body).center;
}

//! The point whose position counts in a region; regions about no position have the origin.
template <typename Primitive>
Vector3 position_in_body(const Scene& scene, const Primitive& primitive) {
  return position_in_body(scene, primitive.body, primitive.point);
}
inline Vector3 position_in_body(const Scene&, const regions::Speed&) { return Vector3::Zero(); }
inline Vector3 position_in_body(const Scene&, const regions::Tilt&) { return Vector3::Zero(); }

//! Reads the body of a primitive out of a state vector, as seen from its frame; of Swept also the body that sweeps.
class BodyReader {
 public:
  template <typename Primitive>
  BodyReader(const Scene& scene, std::shared_ptr<const Kinematics> kinematics, const Primitive& primitive)
      : kinematics_(std::move(kinematics)), point_(position_in_body(scene, primitive)) {
    body_ = scene.index(primitive.body);
    if constexpr (std::is_same_v<Primitive, regions::Swept>) {
      other_ = scene.index(primitive.by);
    } else {
      in_world_ = primitive.frame.empty();
      if (!in_world_) other_ = scene.index(primitive.frame);
    }
  }

  //! The frame's body, or the one that sweeps.
  BodyState other(const double* state) const { return (*kinematics_)(state, other_); }

  //! Position of the point.
  Vector3 position(const double* state) const {
    const Vector3 position = state_at_point(point_, (*kinematics_)(state, body_)).position;
    if (in_world_) return position;
    const BodyState frame = other(state);
    return frame.orientation.conjugate() * (position - frame.position);
  }

  //! Velocity of the frame's body, in its own axes.
  Vector3 frame_velocity(const double* state) const {
    const BodyState frame = other(state);
    return frame.orientation.conjugate() * frame.velocity;
  }

  Vector3 direction(const double* state, const Vector3& axis) const {
    const Vector3 direction = (*kinematics_)(state, body_).orientation * axis;
    return in_world_ ? direction : Vector3(other(state).orientation.conjugate() * direction);
  }

  //! Velocity of a point of the body, as seen by somebody who moves with the frame.
  Vector3 velocity(const double* state, const regions::Speed& speed) const {
    const BodyState body = (*kinematics_)(state, body_);
    const Vector3 arm = speed.along_world ? speed.point : Vector3(body.orientation * speed.point);
    const Vector3 velocity = body.velocity + body.angular_velocity.cross(arm);
    if (in_world_) return velocity;
    const BodyState frame = other(state);
    const Vector3 velocity_of_frame =
        frame.velocity + frame.angular_velocity.cross(body.position + arm - frame.position);
    return frame.orientation.conjugate() * (velocity - velocity_of_frame);
  }

 private:
  std::shared_ptr<const Kinematics> kinematics_;
  Vector3 point_;  // in the body's frame
  std::size_t body_, other_ = 0;
  bool in_world_ = true;
};

// How far beyond its edge a primitive is of what it reads: negative inside, in the primitive's own unit.

inline double beyond(const regions::AnnularSector& sector, const Vector3& position) {
  const Vector2 arm = position.head<2>() - sector.center;
  const double across = std::abs(arm.norm() - sector.radius) - sector.half_width;
  const double half = 0.5 * std::abs(sector.sweep);
  if (2.0 * half >= full_turn) return across;
  const double middle = sector.start_angle + 0.5 * sector.sweep;
  const double turned = std::abs(std::remainder(portable::atan2(arm.y(), arm.x()) - middle, full_turn));
  return std::max(across, sector.radius * (turned - half));  // along the arc
}

// Of most primitives it is what the state says itself.
template <typename Primitive>
double beyond(const Primitive&, double read) {
  return read;
}
inline double beyond(const regions::Ball& ball, const Vector3& position) {
  return (position - ball.center).norm() - ball.radius;
}
inline double beyond(const regions::Box& box, const Vector3& position) {
  const Vector3 out = (position - box.center).cwiseAbs() - 0.5 * box.size;
  return std::min(out.maxCoeff(), 0.0) + out.cwiseMax(0.0).norm();
}
inline double beyond(const regions::Disc& disc, const Vector3& position) {
  return (position.head<2>() - disc.center).norm() - disc.radius;
}
inline double beyond(const regions::Tilt& tilt, const Vector3& direction) {
  return portable::atan2(direction.cross(tilt.reference).norm(), direction.dot(tilt.reference)) - tilt.limit;
}
inline double beyond(const regions::Speed& speed, const Vector3& velocity) {
  return (speed.along ? velocity.dot(*speed.along) : velocity.norm()) - speed.limit;
}

template <typename Primitive>
Vector3 read(const Primitive&, const BodyReader& body, const double* state) {
  return body.position(state);
}
inline Vector3 read(const regions::Disc&, const BodyReader& body, const double* state) {
  const Vector3 position = body.position(state);
  return {position.x(), position.y(), 0.0};
}
inline Vector3 read(const regions::Speed& speed, const BodyReader& body, const double* state) {
  return body.velocity(state, speed);
}
inline Vector3 read(const regions::Tilt& tilt, const BodyReader& body, const double* state) {
  return body.direction(state, tilt.axis);
}
inline double read(const regions::AnnularSector& sector, const BodyReader& body, const double* state) {
  return beyond(sector, body.position(state));
}
inline double read(const regions::Swept& swept, const BodyReader& body, const double* state) {
  const regions::PlanarMotion motion = swept.at ? *swept.at : planar_motion(body.other(state));
  const Vector3 position = body.position(state);
  const std::optional<regions::AnnularSector> sector = swept_sector(swept, motion);
  return sector ? beyond(*sector, position) : (position.head<2>() - motion.position).norm() - swept.disc_radius;
}
inline double read(const regions::HalfSpace& half_space, const BodyReader& body, const double* state) {
  const double beyond = half_space.normal.dot(body.position(state)) - half_space.offset;
  if (half_space.ahead == 0.0) return beyond;
  return beyond - std::max(half_space.ahead * half_space.normal.dot(body.frame_velocity(state)), 0.0);
}

//! What a primitive reads of the bodies of a scene: a number, or a vector.
template <typename Primitive>
auto body_reader(const Scene& scene, std::shared_ptr<const Kinematics> kinematics, const Primitive& primitive) {
  return [primitive, body = BodyReader(scene, std::move(kinematics), primitive)](const double* state) {
    return read(primitive, body, state);
  };
}

using StateReader = std::function<double(const double*)>;

//! How far two bodies are beyond their gap [m] and, for a set with a force, how much is missing of it [N], else null.
//! Any thread may ask. Implemented in `physics`. Throws std::invalid_argument on two bodies that never collide.
std::pair<StateReader, StateReader> touch_readers(const Scene& scene, const regions::Touching& set);

//! How far the joint of a set is beyond its ends. Throws unless its position is a number of the state.
inline auto joint_reader(const Scene& scene, const regions::Joint& set) {
  const std::size_t joint = scene.joint_index(set.joint);
  if (!scene.joints()[joint].moves()) reject("joint", "'" + set.joint + "'", "one that moves and follows no other");
  return [set, layout = StateLayout(scene), joint](const double* state) {
    const double position = layout.joint(state, joint).position;
    return std::max(set.lower - position, position - set.upper);
  };
}

}  // namespace energymargin

#pragma once
// A body in a state vector, as regions see it: from the world, or from another body.

#include <memory>
#include <string>

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/region.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! Reads one body out of a state vector.
class BodyReader {
 public:
  BodyReader(const Scene& scene, std::shared_ptr<const Kinematics> kinematics, const std::string& name)
      : kinematics_(std::move(kinematics)), body_(scene.index(name)) {}

  BodyState operator()(const double* state) const { return (*kinematics_)(state, body_); }

 private:
  std::shared_ptr<const Kinematics> kinematics_;
  std::size_t body_;
};

//! Where the point is whose position counts, in the body's frame [m]. Throws std::invalid_argument on the centre of
//! mass of a body that is fixed, and has none.
inline Vector3 position_in_body(const Scene& scene, const std::string& name, regions::Point point) {
  if (point == regions::Point::origin) return Vector3::Zero();
  const std::size_t body = scene.index(name);
  if (scene.bodies()[body].fixed()) reject("point", "'center_of_mass' of '" + name + "', which is fixed", "'origin'");
  return scene.inertial(body).center;
}

//! The same for any region about one body; those about no position have the origin.
template <typename Primitive>
Vector3 position_in_body(const Scene& scene, const Primitive& primitive) {
  return position_in_body(scene, primitive.body, primitive.point);
}
inline Vector3 position_in_body(const Scene&, const regions::Speed&) { return Vector3::Zero(); }
inline Vector3 position_in_body(const Scene&, const regions::Tilt&) { return Vector3::Zero(); }

//! A body as seen from a frame: that of another body or, without a name, the world's.
class RelativeReader {
 public:
  RelativeReader(const Scene& scene, const std::shared_ptr<const Kinematics>& kinematics, const std::string& body,
                 const std::string& frame, Vector3 point = Vector3::Zero())
      : body_(scene, kinematics, body),
        in_world_(frame.empty()),
        frame_(scene, kinematics, in_world_ ? body : frame),
        point_(std::move(point)) {}

  //! Of the point.
  Vector3 position(const double* state) const {
    const Vector3 position = state_at_point(point_, body_(state)).position;
    if (in_world_) return position;
    const BodyState frame = frame_(state);
    return frame.orientation.conjugate() * (position - frame.position);
  }

  //! Of the frame's body, in its own axes.
  Vector3 frame_velocity(const double* state) const {
    const BodyState frame = frame_(state);
    return frame.orientation.conjugate() * frame.velocity;
  }

  Vector3 direction(const double* state, const Vector3& axis) const {
    const Vector3 direction = body_(state).orientation * axis;
    return in_world_ ? direction : Vector3(frame_(state).orientation.conjugate() * direction);
  }

  //! Velocity of a point of the body, as seen by somebody who moves with the frame.
  Vector3 velocity(const double* state, const Vector3& point, bool along_world) const {
    const BodyState body = body_(state);
    const Vector3 arm = along_world ? point : Vector3(body.orientation * point);
    const Vector3 velocity = body.velocity + body.angular_velocity.cross(arm);
    if (in_world_) return velocity;
    const BodyState frame = frame_(state);
    const Vector3 velocity_of_frame =
        frame.velocity + frame.angular_velocity.cross(body.position + arm - frame.position);
    return frame.orientation.conjugate() * (velocity - velocity_of_frame);
  }

 private:
  BodyReader body_;
  bool in_world_;
  BodyReader frame_;
  Vector3 point_;  // in the body's frame
};

}  // namespace energymargin

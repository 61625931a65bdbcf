#pragma once
// A body in a state vector, as a primitive region sees it: from the world, or from another body.

#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "energymargin/kinematics.hpp"
#include "energymargin/region.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! How a body moves in x and y.
regions::PlanarMotion planar_motion(const BodyState& body);

//! The annular sector about the instantaneous centre of rotation; none while the body is too slow: then it is the disc.
std::optional<regions::AnnularSector> swept_sector(const regions::Swept& swept, const regions::PlanarMotion& motion);

//! Where a point of a body is, in the body's frame [m]. Throws std::invalid_argument on the centre of mass of a body
//! that is fixed, and has none.
Vector3 position_in_body(const Scene& scene, const std::string& body, regions::Point point);

//! The point whose position counts in a region; regions about no position have the origin.
template <typename Primitive>
Vector3 position_in_body(const Scene& scene, const Primitive& primitive) {
  constexpr bool has_no_position =
      std::is_same_v<Primitive, regions::Speed> || std::is_same_v<Primitive, regions::Tilt>;
  if constexpr (has_no_position) {
    return Vector3::Zero();
  } else {
    return position_in_body(scene, primitive.body, primitive.point);
  }
}

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
  Vector3 position(const double* state) const;

  //! Velocity of the frame's body, in its own axes.
  Vector3 frame_velocity(const double* state) const;

  Vector3 direction(const double* state, const Vector3& axis) const;

  //! Velocity of a point of the body, as seen by somebody who moves with the frame.
  Vector3 velocity(const double* state, const regions::Speed& speed) const;

 private:
  std::shared_ptr<const Kinematics> kinematics_;
  Vector3 point_;  // in the body's frame
  std::size_t body_, other_ = 0;
  bool in_world_ = true;
};

}  // namespace energymargin

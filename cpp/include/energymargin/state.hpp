#pragma once
// The layout of a state vector, in the scene's order. First come the bodies that are neither fixed nor links: position,
// quaternion x, y, z, w, velocity, angular velocity; then the joints that move and follow no other: position, velocity.

#include <map>
#include <string>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

class StateLayout {
 public:
  static constexpr int numbers_per_body = 13;
  static constexpr int velocities_of_body = 7;  //!< where the 6 velocities begin
  static constexpr int numbers_per_joint = 2;

  explicit StateLayout(const Scene& scene);

  int dimension() const { return dimension_; }

  //! First number of a body by its index in the scene; -1 for a fixed body or a link.
  int offset(std::size_t body) const { return offsets_[body]; }

  //! First number of a joint by its index in the scene; -1 for a fixed joint, and one that follows another.
  int joint_offset(std::size_t joint) const { return joints_[joint].follows ? -1 : joints_[joint].offset; }

  //! Where a joint is in the state that starts at `numbers`; a fixed joint is at 0.
  JointState joint(const double* numbers, std::size_t joint) const;

  //! Length and its rate of a tendon, by its index in the scene.
  JointState tendon(const double* numbers, std::size_t tendon) const;

  //! Where a joint or, beyond all joints, a tendon is.
  JointState controlled(const double* numbers, std::size_t index) const {
    return index < joints_.size() ? joint(numbers, index) : tendon(numbers, index - joints_.size());
  }

  //! Reads a body's numbers from a state that starts at `numbers`.
  static BodyState read(const double* numbers);
  static void write(const BodyState& body, double* numbers);

 private:
  struct JointNumbers {
    int offset = -1;  // in a state, of the joint or of the one that it follows
    double multiplier = 1.0;
    double shift = 0.0;
    bool follows = false;
  };

  std::vector<int> offsets_;
  std::vector<JointNumbers> joints_;
  std::vector<std::vector<std::pair<std::size_t, double>>> tendons_;  // their joints and coefficients
  int dimension_ = 0;
};

//! The state vector of a scene; bodies and joints that are left out have the scene's own values.
State pack(const Scene& scene, const std::map<std::string, BodyState>& bodies = {},
           const std::map<std::string, JointState>& joints = {});

//! What a state says.
struct Unpacked {
  std::map<std::string, BodyState> bodies;   //!< of all bodies that are not fixed, links included
  std::map<std::string, JointState> joints;  //!< of all joints that are not fixed, also those that follow another
};
Unpacked unpack(const Scene& scene, const State& state);

//! Throws std::invalid_argument unless `state` has the scene's dimension, finite numbers, unit quaternions, and no
//! velocity that is locked or held. A joint may be beyond its limits. `name` is what the error calls it.
void validate(const Scene& scene, const State& state, const std::string& name = "state");

//! The checks of one body's state.
void validate(const Body& body, const BodyState& state, const std::string& name);

//! The checks of one joint's state.
void validate(const Joint& joint, const JointState& state, const std::string& name);

}  // namespace energymargin

#pragma once
// A joint's position control with compliance, and what the solver knows of it from one part of a step to the next.

#include "energymargin/scene.hpp"

namespace energymargin {

//! The torque is that at the end of the part, of a spring and a damper, which is stable for any stiffness. Over a part
//! of duration h [s] its impulse is h (k (target - q - h v) + d (v_target - v)) = pull - resistance v.
struct JointControl {
  const Joint* joint;                                                    // the scene's
  int link, velocity;                                                    // indices among the tree's
  double target;                                                         // [rad] or [m]
  bool at_limit = false;                                                 // its last impulse was at the torque limit
  double drive_impulse = 0.0, lower_impulse = 0.0, upper_impulse = 0.0;  // of the drive and the stops

  bool drives() const { return joint->stiffness > 0.0 || joint->damping > 0.0; }
  double resistance(double duration) const { return duration * (duration * joint->stiffness + joint->damping); }
  double pull(double duration, double position) const {
    return duration * (joint->stiffness * (target - position) + joint->damping * joint->target_velocity);
  }
  double impulse_limit(double duration) const { return duration * joint->torque_limit; }

  //! Starts anew.
  void forget() { *this = {joint, link, velocity, joint->target}; }
};

}  // namespace energymargin

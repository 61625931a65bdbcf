#pragma once
// A joint's position control with compliance.

#include "energymargin/scene.hpp"

namespace energymargin {

//! The torque is that at the end of the substep, of a spring and a damper, which is stable for any stiffness. Over a
//! substep of duration h [s] its impulse is h (k (target - q - h v) + d (v_target - v)) = pull - resistance v, within
//! the limit.
struct JointControl {
  const Joint* joint;  // the scene's
  int link, velocity;  // indices among the tree's
  double target;       // [rad] or [m]

  bool drives() const { return joint->stiffness > 0.0 || joint->damping > 0.0; }
  bool limited() const { return joint->torque_limit < std::numeric_limits<double>::infinity(); }
  double resistance(double duration) const { return duration * (duration * joint->stiffness + joint->damping); }
  double pull(double duration, double position) const {
    return duration * (joint->stiffness * (target - position) + joint->damping * joint->target_velocity);
  }
  double impulse_limit(double duration) const { return duration * joint->torque_limit; }
};

}  // namespace energymargin

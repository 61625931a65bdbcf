// What the surfaces of bodies add to their contacts: rows that turn, compliance, bouncing, motion.

#include <algorithm>

#include "physics/native/step_equations.hpp"

namespace energymargin {

// Rows about axes come into the cone of friction by the lengths that their coefficients are of it.
StepEquations::Frame StepEquations::frame_of(const ContactPoint& point, const Surface& surface) {
  Frame frame;
  frame[normal_row] = point.normal;
  btPlaneSpace1(point.normal, frame[0], frame[1]);
  if (!(point.friction > 0.0)) return frame;
  frame[usual_rows] = point.normal * std::max(surface.torsional_friction / point.friction, point.lever);
  for (int i = 0; i < 2; ++i) {
    frame[usual_rows + 1 + i] = frame[i] * (surface.rolling_friction / point.friction);
  }
  return frame;
}

// Up to the touch bodies may close; then they part by a share of the error, or as fast as compliance asks for. The
// targets of rows have the motion of what is prescribed by now. False where bodies will bounce once they touch.
bool StepEquations::set_normal(ContactRows& rows, const ContactPoint& point, const Surface& surface,
                               const Substep& substep) const {
  rows.still = rows.target[normal_row];
  if (substep.bounces == Bounces::now) return set_rebound(rows, surface), true;
  const double duration = substep.duration;
  double target = -point.distance / duration;
  if (surface.stiffness > 0.0) {
    const double resistance = duration * (duration * surface.stiffness + surface.damping);
    rows.law.compliant = true;
    rows.law.normal_softness = 1.0 / resistance;
    // A spring and a damper that do not touch yet work on the way after the touch alone.
    if (point.distance < 0.0) target = -duration * surface.stiffness * point.distance / resistance;
  } else if (!(point.distance > 0.0)) {
    share_error(-point.distance, target, rows.recovery);
  }
  rows.target[normal_row] += target;
  return substep.bounces == Bounces::never || !(surface.restitution > 0.0) ||
         !(closing_speed(point) > restitution_speed) || touches(point);
}

btVector3 StepEquations::surface_velocity(std::size_t body) const {
  const Vector3 along_axes = scene_.inertial(body).axes.conjugate() * scene_.bodies()[body].surface_velocity;
  return bodies_.poses()[body].getBasis() * to_bullet(along_axes);
}

// What moves a surface is a motor. Spins are known by the velocities of points a metre apart.
void StepEquations::add_surface_work(const ContactPoint& point) {
  const btVector3& twist = point.friction_twist;
  const auto power = [&](const auto& velocity) {  // of the twist on a body whose points have velocities
    const btVector3 at_rest = velocity(point.grip);
    const btVector3 of_x = velocity(point.grip + btVector3(1, 0, 0)) - at_rest;
    const btVector3 of_y = velocity(point.grip + btVector3(0, 1, 0)) - at_rest;
    return twist.dot({of_y.z(), -of_x.z(), of_x.y()});
  };
  const auto difference = [&](auto velocity_of) {
    if (twist.isZero()) return 0.0;
    return power([&](const btVector3& at) { return velocity_of(point.a, at); }) -
           power([&](const btVector3& at) { return velocity_of(point.b, at); });
  };
  const double belts = point.friction_impulse.dot(surface_velocity(point.a) - surface_velocity(point.b));
  audit.work.friction += belts + difference([this](auto body, const auto& at) { return mean_velocity(body, at); });
  audit.work.plan -= belts + difference([this](auto body, const auto& at) { return prescribed_velocity(body, at); });
}

}  // namespace energymargin

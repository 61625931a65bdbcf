// What the surfaces of bodies add to their contacts: rows that turn, compliance, bouncing, motion.

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "physics/solver/step_equations.hpp"

namespace energymargin {
namespace {

// Bodies touch that would do so within this share of a step.
constexpr double touch = 1e-3;

// What bounces gives way by less than what rests, as a share of that.
constexpr double bouncing_softness = 1e-2;

// A blow that gives bodies energy, by more than this share of what its impulses exchange, parts them by so much less,
// again and again: 0.85^16 is 0.07.
constexpr double least_gain = 1e-4, weaker = 0.85;
constexpr int most_weaker = 16;

}  // namespace

// Rows about axes come into the cone of friction by the lengths that their coefficients are of it.
StepEquations::Frame StepEquations::frame_of(const ContactPoint& point, const Surface& surface) {
  Frame frame;
  frame[normal_row] = point.normal;
  btPlaneSpace1(point.normal, frame[0], frame[1]);
  if (!(point.friction > 0.0)) return frame;
  frame[usual_rows] = point.normal * (surface.torsional_friction / point.friction);
  for (int i = 0; i < 2; ++i) {
    frame[usual_rows + 1 + i] = frame[i] * (surface.rolling_friction / point.friction);
  }
  return frame;
}

// Up to the touch bodies may close; then they part by a share of the error, as fast as compliance asks for, or bounce.
// The targets of rows have the motion of what is prescribed by now. False where bodies will bounce once they touch.
bool StepEquations::set_normal(ContactRows& rows, const ContactPoint& point, const Surface& surface,
                               double duration) const {
  const double still = rows.still = rows.target[normal_row];
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
  if (!(surface.restitution > 0.0)) return true;
  const double speed = still - solver_.speed(rows, normal_row, solver_.all_velocities());
  if (!(speed > restitution_speed)) return true;
  const double step = scene_.stepping().step;
  if (point.distance > touch * speed * step) return false;
  // Velocities are those of the middle of the step before: they lack half a step of what pulls the bodies together.
  const double pull = (still - solver_.speed(rows, normal_row, solver_.all_free()) - speed) / duration;
  const double separation = surface.restitution * (speed + 0.5 * step * pull) + pull * (0.5 * step - duration);
  rows.rebound = std::max(0.0, still + separation - rows.target[normal_row]);
  rows.target[normal_row] += rows.rebound;
  if (!rows.law.compliant) rows.law.normal_softness *= bouncing_softness;
  return true;
}

// Solves again while blows were too strong. Whether the last solution converged.
bool StepEquations::weaken_bounces(bool converged) {
  const Stepping& stepping = scene_.stepping();
  for (int i = 0; i < most_weaker && weaken_gains(); ++i) {
    converged = solver_.solve(stepping.iterations, stepping.tolerance, true);
  }
  return converged;
}

// Newton's law of impact may give energy where bodies slip (Kane 1984). What two bodies exchange counts as one blow. A
// rebound may have a little more energy than the blow, by the half step that velocities lag behind: that is no gain.
// Whether a blow was too strong.
bool StepEquations::weaken_gains() {
  struct Blow {
    double gain = 0.0, exchanged = 0.0;
  };
  std::map<std::pair<int, int>, Blow> blows;
  for (const ContactRows& rows : solver_.contacts()) {
    if (rows.rebound > 0.0) blows[std::minmax(rows.a, rows.b)];
  }
  if (blows.empty()) return false;
  for (const ContactRows& rows : solver_.contacts()) {
    const auto blow = blows.find(std::minmax(rows.a, rows.b));
    if (blow == blows.end()) continue;
    for (int i = 0; i < rows.law.rows; ++i) {
      const double moved = i == normal_row ? rows.still : rows.target[i];
      const double before = solver_.speed(rows, i, solver_.all_free()) - moved;
      const double after = solver_.speed(rows, i, solver_.all_velocities()) - moved;
      const double mean = 0.5 * (before + after);
      blow->second.gain += rows.impulse[i] * (i == normal_row && rows.rebound > 0.0 ? std::min(0.0, mean) : mean);
      blow->second.exchanged += 0.5 * std::abs(rows.impulse[i] * before);
    }
  }
  bool changed = false;
  for (ContactRows& rows : solver_.contacts()) {
    if (!(rows.rebound > 0.0)) continue;
    const Blow& blow = blows[std::minmax(rows.a, rows.b)];
    if (!(blow.gain > least_gain * blow.exchanged)) continue;
    rows.target[normal_row] -= (1.0 - weaker) * rows.rebound;
    rows.rebound *= weaker;
    changed = true;
  }
  return changed;
}

double StepEquations::until_bounce(const std::vector<ContactPoint>& contacts, double duration) const {
  if (!surfaces_) return duration;
  double least = duration;
  for (const ContactPoint& point : contacts) {
    if (!(point.distance > 0.0 && scene_.contact_surface(point.a, point.b).restitution > 0.0)) continue;
    const btVector3 apart = bodies_.velocity(point.a, point.on_a) - bodies_.velocity(point.b, point.on_b);
    const double speed = -point.normal.dot(apart);
    if (speed > restitution_speed && point.distance > touch * speed * duration) {
      least = std::min(least, point.distance / speed);
    }
  }
  return least;
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

// Locked axes of free bodies, where a surface bears what they would: there the surface has friction.

#include <algorithm>
#include <cmath>

#include "physics/native/step_equations.hpp"

namespace energymargin {
namespace {

// A surface lies along a locked axis if its normal has no more than this beside what is locked (5.7 degrees).
constexpr double nearly_along = 0.1;

// A body whose face is no farther from a surface lies on it: what is locked does not fall onto it [m].
constexpr double most_hover = 1e-3;

// What a lock gives way by, away from the surface: others may lift the body as fast to put an overlap right [m/s].
constexpr double most_lift = 1e-3;

}  // namespace

// A locked axis is released for a substep where its load presses the body onto surfaces across it: they bear the load
// then, together with what presses on the body otherwise. The lock still keeps the body from leaving them, and takes
// the velocity along the axis.
void StepEquations::release_locked(const std::vector<ContactPoint>& contacts) {
  if (!locks_) return;
  for (FreeBody& body : bodies_.free()) body.axes.resize(body.unlocked);
  for (const ContactPoint& point : contacts) {
    if (!(point.friction > 0.0) || point.distance > most_hover) continue;
    release(point.a, point.normal);
    release(point.b, -point.normal);
  }
}

// `normal` points from the surface to the body.
void StepEquations::release(std::size_t index, const btVector3& normal) {
  FreeBody* const body = bodies_.free(index);
  if (!body || body->unlocked == 0 || !stays(index, normal)) return;
  const btVector3 load = locked_load(*body);
  for (int axis = 0; axis < 3; ++axis) {
    const bool pressed = load[axis] * normal[axis] < 0.0 && std::abs(normal[axis]) > nearly_along;
    if (pressed && std::find(body->axes.begin(), body->axes.end(), axis) == body->axes.end()) {
      body->axes.push_back(axis);
    }
  }
}

// What acts along the locked axes, per mass.
btVector3 StepEquations::locked_load(const FreeBody& body) {
  return body.held + body.force * body.inverse_mass * (btVector3(1, 1, 1) - body.linear_factor);
}

void StepEquations::hold_released(const FreeBody& body) {
  const btVector3 load = locked_load(body);
  for (std::size_t row = body.unlocked; row < body.axes.size(); ++row) {
    LimitedRow& hold = solver_.add_limited(body.mover, -1);
    solver_.numbers(hold.of_a)[row] = load[body.axes[row]] > 0.0 ? 1.0 : -1.0;
    hold.low = 0.0;
    hold.target = -most_lift;
    hold.softness = softness_share * solver_.inverse_mass(hold, 0);
  }
}

// Whether no impulse moves a body along a normal, or hardly, but for its turning.
bool StepEquations::stays(std::size_t index, const btVector3& normal) const {
  const Body& body = scene_.bodies()[index];
  if (body.fixed() || body.kinematic) return true;
  const FreeBody* const free = bodies_.free(index);
  return free && (normal * free->linear_factor).length2() <= nearly_along * nearly_along;
}

// Whether a contact bears what a locked axis would, between bodies that do not come closer.
bool StepEquations::bears(const ContactPoint& point) const {
  if (!locks_ || point.distance > most_hover) return false;
  const auto released = [this](std::size_t index) {
    const FreeBody* const body = bodies_.free(index);
    return body && body->axes.size() > body->unlocked;
  };
  return (released(point.a) || released(point.b)) && stays(point.a, point.normal) && stays(point.b, point.normal);
}

// Its bodies keep their gap, which the lock sets; an overlap is put right beside the velocities alone, so that it adds
// nothing to the load.
bool StepEquations::set_bearing(ContactRows& rows, double distance) const {
  double slowly = 0.0;
  if (distance < 0.0) share_error(-distance, slowly, rows.recovery);
  rows.recovery += slowly;
  rows.target[normal_row] = 0.0;
  return true;
}

}  // namespace energymargin

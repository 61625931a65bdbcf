#include <algorithm>
#include <cmath>
#include <string>

#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "problem/penetration.hpp"
#include "problem/records.hpp"

namespace energymargin {
namespace {

// A share of the smaller body's smallest half extent. What a simulation returns is no deep penetration: there bodies
// sink into each other by up to 0.3 of it.
constexpr double deep = 0.5;

// A disturbance along a locked axis does nothing, and would pass for robustness.
void require_free(const std::string& name, const Vector3& bounds, const Vector3& factor) {
  if (((bounds.array() > 0.0) && (factor.array() == 0.0)).any()) {
    reject(name, text(bounds), "0 on the axes that are locked for the object, whose factors are " + text(factor));
  }
}

void require_roles(const Scene& scene, Effector effector) {
  if (scene.with_role(Role::object).empty()) reject("scene", "without a body of role \"object\"", "at least one");
  const std::vector<std::size_t> effectors = scene.with_role(Role::effector);
  const bool moves =
      std::any_of(effectors.begin(), effectors.end(), [&](std::size_t body) { return !scene.bodies()[body].fixed(); });
  if (effector == Effector::drive && !moves) {
    reject("effector", "\"drive\"", "a scene with a body of role \"effector\" that can move, or \"coast\"");
  }
}

void require_no_deep_penetration(const Scene& scene, const State& state) {
  const Contact contact = deepest_contact(scene, state);
  if (contact.distance == 0.0) return;
  const double most = deep * smaller_half_extent(scene, contact);
  if (-contact.distance > most) {
    reject("state",
           "one in which '" + contact.body_a + "' and '" + contact.body_b + "' penetrate each other by " +
               text(-contact.distance) + " m",
           "at most " + text(most) + " m");
  }
}

void require_region(const std::string& name, const Region& region, const Scene& scene) {
  try {
    Membership(region, scene);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + ": " + error.what());
  }
}

void require_whole_steps(const std::string& name, double value, int least, double step) {
  const double steps = std::round(value / step);
  const bool whole = std::abs(value - steps * step) <= 1e-6 * step * std::max(1.0, steps);
  if (whole && steps >= least && steps <= most_steps) return;
  const std::string from = least == 0 ? "0, or " : "";
  reject(name, text(value),
         from + "whole steps of the scene, of " + text(step) + " s, at most " + std::to_string(most_steps));
}

void require_clock(const Problem& problem) {
  const double step = problem.scene.stepping().step;
  if (problem.horizon) require_whole_steps("horizon", *problem.horizon, 1, step);
  if (problem.check) require_whole_steps("check", *problem.check, 1, step);
  require_whole_steps("dwell", problem.dwell, 0, step);
  if (!problem.plan) return;
  validate(*problem.plan, problem.scene);
  if (problem.effector == Effector::drive) {
    reject("effector", "\"drive\" with a plan", "\"coast\": the plan says what the effector does");
  }
  if (problem.horizon && problem.plan->duration() < *problem.horizon - 0.5 * step) {
    reject("plan", text(problem.plan->duration()) + " s",
           "at least as long as the horizon, " + text(*problem.horizon) + " s");
  }
}

void require_disturbance(const Problem& problem) {
  require_form("force", problem.force, Form::bounds);
  require_form("torque", problem.torque, Form::bounds);
  if (problem.force.isZero(0.0) && problem.torque.isZero(0.0)) {
    reject("force and torque", "0 on all axes", "at least one axis on which a disturbance can act");
  }
  for (const std::size_t index : problem.scene.with_role(Role::object)) {
    const Body& object = problem.scene.bodies()[index];
    require_free("force", problem.force, object.linear_factor);
    require_free("torque", problem.torque, object.angular_factor);
  }
  const double step = problem.scene.stepping().step;
  if (!(problem.duration >= step && problem.duration <= most_steps * step)) {
    reject("duration", text(problem.duration),
           "at least one step, " + text(step) + " s, and at most " + std::to_string(most_steps) + " steps");
  }
}

}  // namespace

void validate(const Problem& problem) {
  const Scene& scene = problem.scene;
  require_roles(scene, problem.effector);
  validate(scene, problem.state);
  require_disturbance(problem);
  require_clock(problem);
  require_fields(problem);
  require_region("captured", problem.captured, scene);
  if (problem.succeeded) require_region("succeeded", *problem.succeeded, scene);
  if (problem.captured_any) require_region("captured_any", *problem.captured_any, scene);
  if (problem.succeeded_any) require_region("succeeded_any", *problem.succeeded_any, scene);
  if (problem.within) {
    require_region("within", *problem.within, scene);
    if (!Membership(*problem.within, scene)(problem.state)) {
      reject("state", "outside of the bounds `within`", "a start inside, or no bounds");
    }
  }
  for (const Contact& contact : problem.contacts.value_or(std::vector<Contact>{})) {
    scene.index(contact.body_a);
    scene.index(contact.body_b);
    require_fields(contact, "contact ");
  }
  require_no_deep_penetration(scene, problem.state);
}

}  // namespace energymargin

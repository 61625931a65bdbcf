#pragma once
// The words of enums, and the fields of problems, in the order of files, and of models of disturbances.

#include <tuple>

#include "base/record.hpp"
#include "energymargin/disturbances.hpp"
#include "energymargin/problem.hpp"
#include "scene/records.hpp"

namespace energymargin {

template <>
struct Words<Effector> {
  static constexpr std::pair<const char*, Effector> all[]{{"coast", Effector::coast}, {"drive", Effector::drive}};
};

template <>
struct Words<Captured> {
  static constexpr std::pair<const char*, Captured> all[]{{"all", Captured::all}, {"any", Captured::any}};
};

constexpr auto describe(Type<ForceWeights>) {
  return Description{
      "force_weights",
      "Weights of the force score; left out: the usual ones.",
      Field{"engage", &ForceWeights::engage, "Of the normal forces between effector and objects [1/N]."},
      Field{"stick", &ForceWeights::stick, "Of their distance to the edge of the friction cone [1/N]."},
      Field{"distance", &ForceWeights::distance, "Taken off per metre between object and effector [1/m]."},
      Field{"ground_engage", &ForceWeights::ground_engage,
            "As engage, for contacts with all that is not the effector [1/N]."},
      Field{"ground_stick", &ForceWeights::ground_stick, "As stick, for those [1/N]."}};
}

constexpr auto describe(Type<Contact>) {
  return Description{
      "contact",
      "One point where two bodies touch, and the forces there.",
      Field{"body_a", &Contact::body_a, "A body.", Form::body},
      Field{"body_b", &Contact::body_b, "Another body.", Form::body},
      Field{"position", &Contact::position, "On body_b, in the world [m]."},
      Field{"normal", &Contact::normal, "Unit vector from body_b to body_a, in the world's axes."},
      Field{"distance", &Contact::distance, "Between the surfaces; negative: depth [m]."},
      Field{"normal_force", &Contact::normal_force, "Along the normal, on body_a [N]."},
      Field{"tangential_force", &Contact::tangential_force, "Friction on body_a, in the world's axes [N]."},
      Field{"friction", &Contact::friction, "The contact's coefficient.", Form::not_negative}};
}

constexpr auto problem_bounds() {
  return std::tuple{
      Field{"force", &Problem::force,
            "Largest |force| of the disturbance on each object, along the world's x, y and z axes [N].", Form::bounds},
      Field{"torque", &Problem::torque,
            "Largest |torque| of the disturbance on each object, about the world's x, y and z axes [N m].",
            Form::bounds},
      Field{"duration", &Problem::duration, "Longest edge of the search [s]; at least one step of the simulation.",
            Form::positive}};
}

//! Python takes one for each object, too.
constexpr auto problem_sets() {
  return std::tuple{
      Field{"captured", &Problem::captured, "The capture set Z_cap; of several objects: all are captured."},
      Field{"succeeded", &Problem::succeeded, "The success set Z_suc; of several objects: all have succeeded.",
            Presence::optional},
      Field{"within", &Problem::within, "Bounds Z_b: where the search for an escape may go. The start is inside.",
            Presence::optional},
      Field{"captured_any", &Problem::captured_any, "Of several objects: at least one is captured.",
            Presence::optional},
      Field{"succeeded_any", &Problem::succeeded_any, "Of several objects: at least one has succeeded.",
            Presence::optional}};
}

constexpr auto problem_question() {
  return std::tuple{
      Field{"effector", &Problem::effector,
            "What the effector does while the objects are disturbed. coast: no script acts on it. drive: each edge of "
            "the search starts with its velocities of the start."},
      Field{"rate", &Problem::rate,
            "lambda: how fast the likelihood of a state falls with the work to get there [1/J].", Form::not_negative},
      Field{"force_weights", &Problem::force_weights, "Weights of the force score.", Presence::added},
      Field{"contacts", &Problem::contacts,
            "Contacts that were measured at the state, for the force score; left out: simulated.", Presence::optional},
      Field{"horizon", &Problem::horizon,
            "The question is about the next so many seconds, whole steps of the simulation; left out: as long as the "
            "plan, or without a clock.",
            Form::positive, Presence::optional},
      Field{"check", &Problem::check,
            "Time between two looks at the capture set, whole steps of the simulation [s]; left out: about 1/60.",
            Form::positive, Presence::optional},
      Field{"dwell", &Problem::dwell,
            "How long an object has to stay outside of the capture set for an escape, whole steps of the simulation "
            "[s]; left out: 0.",
            Form::not_negative, Presence::optional},
      Field{"plan", &Problem::plan, "The robot's actions from the state on; left out: the effector coasts.",
            Presence::optional}};
}

constexpr auto describe(Type<Problem>) {
  return Description{nullptr, "A problem, but for its scene and state, which the others need.",
                     std::tuple_cat(problem_bounds(), problem_sets(), problem_question())};
}

template <>
inline Problem initial<Problem>() {
  return {Scene(), State(), regions::Ball{}};
}

constexpr auto describe(Type<disturbances::Uniform>) {
  using Uniform = disturbances::Uniform;
  return Description{
      nullptr,
      "Piecewise constant. Each piece is uniform within strength times the problem's bounds, along and about each "
      "axis, and lasts for a uniform time.",
      Field{"strength", &Uniform::strength, "Share of the problem's bounds.", Form::not_negative},
      Field{"objects", &Uniform::objects, "How many objects each piece acts on, drawn for each piece; None: all."},
      Field{"hold", &Uniform::hold, "Longest piece [s]; None: the problem's duration.", Form::positive}};
}

constexpr auto describe(Type<disturbances::Gaussian>) {
  using Gaussian = disturbances::Gaussian;
  return Description{
      nullptr,
      "Normal in each step, on the axes whose bounds are not 0. The correlation decays as exp(-t / correlation_time).",
      Field{"force", &Gaussian::force, "Standard deviation along each axis [N].", Form::not_negative},
      Field{"torque", &Gaussian::torque, "Standard deviation about each axis [N m].", Form::not_negative},
      Field{"correlation_time", &Gaussian::correlation_time, "Time constant of the correlation [s].",
            Form::not_negative}};
}

constexpr auto describe(Type<disturbances::Boltzmann>) {
  return Description{
      nullptr,
      "Uniform, with each rollout weighted by exp(-rate * effort): more work is less likely (eq. 4). All rollouts run "
      "to the horizon.",
      Field{"rate", &disturbances::Boltzmann::rate, "lambda [1/J].", Form::not_negative},
      Field{"strength", [](auto& model) -> auto& { return model.proposal.strength; }, "As Uniform.",
            Form::not_negative},
      Field{"objects", [](auto& model) -> auto& { return model.proposal.objects; }, "As Uniform."},
      Field{"hold", [](auto& model) -> auto& { return model.proposal.hold; }, "As Uniform.", Form::positive}};
}

constexpr auto describe(Type<disturbances::ActuationNoise>) {
  using Noise = disturbances::ActuationNoise;
  return Description{
      nullptr,
      "Noise of the robot: a uniform draw is added to its plan.",
      Field{"force", &Noise::force, "Largest along each axis, on each body that the plan pushes or drives [N].",
            Form::bounds},
      Field{"torque", &Noise::torque, "The same about each axis [N m].", Form::bounds},
      Field{"targets", &Noise::targets, "Largest error of each joint's target [rad] or [m].", Form::not_negative},
      Field{"hold", &Noise::hold, "How long a draw lasts [s]; None: a step.", Form::positive}};
}

}  // namespace energymargin

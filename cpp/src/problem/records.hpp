#pragma once
// The fields of what a problem has besides its scene and its regions, in the order of problem files; and those of
// models of disturbances, which are in no file.

#include <tuple>

#include "base/record.hpp"
#include "energymargin/disturbances.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

template <>
struct Record<ForceWeights> {
  static constexpr const char* name = "force_weights";
  static constexpr const char* description = "Weights of the force score; left out: the usual ones.";
  static auto fields() {
    return std::tuple{
        Field{"engage", &ForceWeights::engage, "Of the normal forces between effector and objects [1/N]."},
        Field{"stick", &ForceWeights::stick, "Of their distance to the edge of the friction cone [1/N]."},
        Field{"distance", &ForceWeights::distance, "Taken off per metre between object and effector [1/m]."},
        Field{"ground_engage", &ForceWeights::ground_engage,
              "As engage, for contacts with all that is not the effector [1/N]."},
        Field{"ground_stick", &ForceWeights::ground_stick, "As stick, for those [1/N]."},
    };
  }
};

template <>
struct Record<Contact> {
  static constexpr const char* name = "contact";
  static constexpr const char* description = "One point where two bodies touch, and the forces there.";
  static auto fields() {
    return std::tuple{
        Field{"body_a", &Contact::body_a, "A body.", forms::body},
        Field{"body_b", &Contact::body_b, "Another body.", forms::body},
        Field{"position", &Contact::position, "On body_b, in the world [m]."},
        Field{"normal", &Contact::normal, "Unit vector from body_b to body_a, in the world's axes."},
        Field{"distance", &Contact::distance, "Between the surfaces; negative: depth [m]."},
        Field{"normal_force", &Contact::normal_force, "Along the normal, on body_a [N]."},
        Field{"tangential_force", &Contact::tangential_force, "Friction on body_a, in the world's axes [N]."},
        Field{"friction", &Contact::friction, "The contact's coefficient.", forms::not_negative},
    };
  }
};

template <>
struct Record<disturbances::Uniform> {
  using Uniform = disturbances::Uniform;
  static constexpr const char* description =
      "Piecewise constant. Each piece is uniform within strength times the problem's bounds, along and about each "
      "axis, "
      "and lasts for a uniform time.";
  static auto fields() {
    return std::tuple{
        Field{"strength", &Uniform::strength, "Share of the problem's bounds.", forms::not_negative},
        Field{"objects", &Uniform::objects, "How many objects each piece acts on, drawn for each piece; None: all."},
        Field{"hold", &Uniform::hold, "Longest piece [s]; None: the problem's duration.", forms::positive},
    };
  }
};

template <>
struct Record<disturbances::Gaussian> {
  using Gaussian = disturbances::Gaussian;
  static constexpr const char* description =
      "Normal in each step, on the axes whose bounds are not 0. The correlation decays as exp(-t / correlation_time).";
  static auto fields() {
    return std::tuple{
        Field{"force", &Gaussian::force, "Standard deviation along each axis [N].", forms::not_negative},
        Field{"torque", &Gaussian::torque, "Standard deviation about each axis [N m].", forms::not_negative},
        Field{"correlation_time", &Gaussian::correlation_time, "Time constant of the correlation [s].",
              forms::not_negative},
    };
  }
};

template <>
struct Record<disturbances::Boltzmann> {
  static constexpr const char* description =
      "Uniform, with each rollout weighted by exp(-rate * effort): more work is less likely (eq. 4). All rollouts run "
      "to "
      "the horizon.";
  static auto fields() {
    return std::tuple{
        Field{"rate", &disturbances::Boltzmann::rate, "lambda [1/J].", forms::not_negative},
        Field{"strength", [](auto& model) -> auto& { return model.proposal.strength; }, "As Uniform.",
              forms::not_negative},
        Field{"objects", [](auto& model) -> auto& { return model.proposal.objects; }, "As Uniform."},
        Field{"hold", [](auto& model) -> auto& { return model.proposal.hold; }, "As Uniform.", forms::positive},
    };
  }
};

template <>
struct Record<disturbances::ActuationNoise> {
  using Noise = disturbances::ActuationNoise;
  static constexpr const char* description = "Noise of the robot: a uniform draw is added to its plan.";
  static auto fields() {
    return std::tuple{
        Field{"force", &Noise::force, "Largest along each axis, on each body that the plan pushes or drives [N].",
              forms::bounds},
        Field{"torque", &Noise::torque, "The same about each axis [N m].", forms::bounds},
        Field{"targets", &Noise::targets, "Largest error of each joint's target [rad] or [m].", forms::not_negative},
        Field{"hold", &Noise::hold, "How long a draw lasts [s]; None: a step.", forms::positive},
    };
  }
};

}  // namespace energymargin

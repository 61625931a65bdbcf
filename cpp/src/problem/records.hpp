#pragma once
// The fields of what a problem has besides its scene and its regions, in the order of problem files.

#include <tuple>

#include "base/record.hpp"
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

}  // namespace energymargin

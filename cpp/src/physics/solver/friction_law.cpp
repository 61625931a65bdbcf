#include "physics/solver/friction_law.hpp"

#include <cmath>

namespace energymargin {
namespace {

void stick(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double tangential = 1.0 / law.tangential_softness;
  response.open = false;
  response.impulse[0] = miss[0] * tangential;
  response.impulse[1] = miss[1] * tangential;
  response.slope[0] = {tangential, 0.0, 0.0};
  response.slope[1] = {0.0, tangential, 0.0};
}

// Friction at its limit; what does not turn it is left to the caller.
void slide(const FrictionLaw& law, const ContactVector& miss, double slip, double normal, ContactResponse& response) {
  const double x = miss[0] / slip;
  const double y = miss[1] / slip;
  const double most = law.friction * normal;
  const double turning = most / slip;
  response.open = false;
  response.impulse = {most * x, most * y, normal};
  response.slope[0] = {turning * y * y, -turning * x * y, 0.0};
  response.slope[1] = {-turning * x * y, turning * x * x, 0.0};
}

void press(double miss, double softness, ContactResponse& response) {
  if (!(miss > 0.0)) return;
  response.open = false;
  response.impulse[2] = miss / softness;
  response.slope[2][2] = 1.0 / softness;
}

}  // namespace

double shift_of(const FrictionLaw& law, const ContactVector& miss) {
  return law.friction * std::sqrt(miss[0] * miss[0] + miss[1] * miss[1]);
}

void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  response = {};
  const double mu = law.friction;
  if (mu == 0.0) return press(miss[2], law.normal_softness, response);
  if (!(miss[2] > 0.0)) return;
  const double slip = std::sqrt(miss[0] * miss[0] + miss[1] * miss[1]);
  const double stiffness = 1.0 / (law.normal_softness + mu * mu * law.tangential_softness);
  const double normal = miss[2] * stiffness;
  if (slip <= mu * normal * law.tangential_softness) {
    stick(law, miss, response);
    const double sticking = 1.0 / law.normal_softness;
    response.impulse[2] = (miss[2] - mu * slip) * sticking;
    response.slope[2] = {0.0, 0.0, sticking};
    if (slip > 0.0) {
      response.slope[2][0] = -mu * miss[0] / slip * sticking;
      response.slope[2][1] = -mu * miss[1] / slip * sticking;
    }
    return;
  }
  slide(law, miss, slip, normal, response);
  response.slope[0][2] = mu * miss[0] / slip * stiffness;
  response.slope[1][2] = mu * miss[1] / slip * stiffness;
  response.slope[2][2] = stiffness;
}

void convex(const FrictionLaw& law, const ContactVector& miss, double shift, ContactResponse& response) {
  response = {};
  const double mu = law.friction;
  if (mu == 0.0) return press(miss[2], law.normal_softness, response);
  const double pressed = miss[2] - shift;
  const double slip = std::sqrt(miss[0] * miss[0] + miss[1] * miss[1]);
  if (pressed >= 0.0 && slip * law.normal_softness <= mu * pressed * law.tangential_softness) {
    stick(law, miss, response);
    response.impulse[2] = pressed / law.normal_softness;
    response.slope[2] = {0.0, 0.0, 1.0 / law.normal_softness};
    return;
  }
  const double stiffness = 1.0 / (law.normal_softness + mu * mu * law.tangential_softness);
  const double normal = (pressed + mu * slip) * stiffness;
  if (!(normal > 0.0)) return;
  slide(law, miss, slip, normal, response);
  const double x = miss[0] / slip;
  const double y = miss[1] / slip;
  const double coupled = mu * stiffness;
  response.slope[0][0] += mu * coupled * x * x;
  response.slope[0][1] += mu * coupled * x * y;
  response.slope[1][0] += mu * coupled * x * y;
  response.slope[1][1] += mu * coupled * y * y;
  response.slope[0][2] = response.slope[2][0] = coupled * x;
  response.slope[1][2] = response.slope[2][1] = coupled * y;
  response.slope[2][2] = stiffness;
}

}  // namespace energymargin

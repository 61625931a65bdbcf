#include "physics/solver/friction_law.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

double squared_slip(const ContactVector& miss) { return miss[0] * miss[0] + miss[1] * miss[1]; }

void open(ContactResponse& response) {
  response.regime = Regime::open;
  response.impulse = {};
  response.slope = {};
}

// The response along the normal.
void press(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double stiffness = 1.0 / law.normal_softness;
  response.impulse[2] = miss[2] * stiffness;
  response.slope[2] = {0.0, 0.0, stiffness};
}

void stick(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double stiffness = law.friction > 0.0 ? 1.0 / law.tangential_softness : 0.0;
  response.regime = Regime::sticks;
  press(law, miss, response);
  response.impulse[0] = miss[0] * stiffness;
  response.impulse[1] = miss[1] * stiffness;
  response.slope[0] = {stiffness, 0.0, 0.0};
  response.slope[1] = {0.0, stiffness, 0.0};
}

// Friction at its limit along (x, y), which turns towards the miss by that much.
void slide(const FrictionLaw& law, const ContactVector& miss, double x, double y, double turning,
           ContactResponse& response) {
  response.regime = Regime::slides;
  press(law, miss, response);
  const double most = law.friction * response.impulse[2];
  const double across = turning * (y * miss[0] - x * miss[1]);
  const double by_normal = law.friction * response.slope[2][2];
  response.impulse[0] = most * x + y * across;
  response.impulse[1] = most * y - x * across;
  response.slope[0] = {turning * y * y, -turning * x * y, by_normal * x};
  response.slope[1] = {-turning * x * y, turning * x * x, by_normal * y};
}

// Against the slip.
void slide(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double slip = std::sqrt(squared_slip(miss));
  if (!(slip > 0.0)) return stick(law, miss, response);
  const double inverse = 1.0 / slip;
  const double most = std::max(0.0, law.friction * miss[2] / law.normal_softness);
  slide(law, miss, miss[0] * inverse, miss[1] * inverse, most * inverse, response);
}

}  // namespace

void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (!(miss[2] > 0.0)) return open(response);
  const double most = law.friction * miss[2] * law.tangential_softness;
  const double slips = law.normal_softness * law.normal_softness * squared_slip(miss);
  if (slips > most * most && law.friction > 0.0) return slide(law, miss, response);
  stick(law, miss, response);
}

void augmented(const FrictionLaw& law, const ContactVector& miss, const ContactVector& impulse,
               ContactResponse& response) {
  const double by_normal = FrictionLaw::normal_share / law.normal_softness;
  const double normal = impulse[2] + by_normal * (miss[2] - law.normal_softness * impulse[2]);
  if (!(normal > 0.0)) return open(response);
  if (!(law.friction > 0.0)) return stick(law, miss, response);
  const double weight = FrictionLaw::tangential_share / law.tangential_softness;
  const ContactVector asked{impulse[0] + weight * (miss[0] - law.tangential_softness * impulse[0]),
                            impulse[1] + weight * (miss[1] - law.tangential_softness * impulse[1]), 0.0};
  const double length = std::sqrt(squared_slip(asked));
  const double most = law.friction * std::max(0.0, impulse[2]);
  if (length <= most) return stick(law, miss, response);
  const double turning = std::min(most * weight / (length - most), 1.0 / law.tangential_softness);
  slide(law, miss, asked[0] / length, asked[1] / length, turning, response);
}

void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (regime == Regime::open) return open(response);
  if (regime == Regime::sticks || !(law.friction > 0.0)) return stick(law, miss, response);
  slide(law, miss, response);
}

}  // namespace energymargin

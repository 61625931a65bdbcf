#include "physics/solver/friction_law.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

double slip_of(const ContactVector& miss) { return std::sqrt(miss[0] * miss[0] + miss[1] * miss[1]); }

void press(double impulse, double stiffness, ContactResponse& response) {
  response.impulse[2] = impulse;
  response.slope[2] = {0.0, 0.0, stiffness};
}

void stick(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double stiffness = 1.0 / law.tangential_softness;
  response.impulse[0] = miss[0] * stiffness;
  response.impulse[1] = miss[1] * stiffness;
  response.slope[0] = {stiffness, 0.0, 0.0};
  response.slope[1] = {0.0, stiffness, 0.0};
}

// Friction at its limit, against the slip.
void slide(const FrictionLaw& law, const ContactVector& miss, double slip, ContactResponse& response) {
  const double x = miss[0] / slip;
  const double y = miss[1] / slip;
  const double most = law.friction * response.impulse[2];
  const double turning = std::max(0.0, most) / slip;
  const double by_normal = law.friction * response.slope[2][2];
  response.impulse[0] = most * x;
  response.impulse[1] = most * y;
  response.slope[0] = {turning * y * y, -turning * x * y, by_normal * x};
  response.slope[1] = {-turning * x * y, turning * x * x, by_normal * y};
}

}  // namespace

void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (!(miss[2] > 0.0)) {  // no one reads the slope of what is open
    response.regime = Regime::open;
    response.impulse = {};
    return;
  }
  const double most = law.friction * miss[2] / law.normal_softness;
  const bool sticks = slip_of(miss) <= most * law.tangential_softness;
  respond_as(sticks ? Regime::sticks : Regime::slides, law, miss, response);
}

void augmented(const FrictionLaw& law, const ContactVector& miss, const ContactVector& impulse,
               ContactResponse& response) {
  const double by_normal = FrictionLaw::normal_share / law.normal_softness;
  const double normal = impulse[2] + by_normal * (miss[2] - law.normal_softness * impulse[2]);
  if (!(normal > 0.0)) return respond_as(Regime::open, law, miss, response);
  if (law.friction == 0.0) return respond_as(Regime::sticks, law, miss, response);
  const double weight = FrictionLaw::tangential_share / law.tangential_softness;
  const ContactVector asked{impulse[0] + weight * (miss[0] - law.tangential_softness * impulse[0]),
                            impulse[1] + weight * (miss[1] - law.tangential_softness * impulse[1]), 0.0};
  const double length = slip_of(asked);
  const double most = law.friction * std::max(0.0, impulse[2]);
  if (length <= most) return respond_as(Regime::sticks, law, miss, response);
  response = {};
  response.regime = Regime::slides;
  const double stiffness = 1.0 / law.normal_softness;
  press(miss[2] * stiffness, stiffness, response);
  const double x = asked[0] / length;
  const double y = asked[1] / length;
  const double turning = std::min(most * weight / (length - most), 1.0 / law.tangential_softness);
  const double across = y * miss[0] - x * miss[1];
  response.impulse[0] = law.friction * response.impulse[2] * x + turning * y * across;
  response.impulse[1] = law.friction * response.impulse[2] * y - turning * x * across;
  response.slope[0] = {turning * y * y, -turning * x * y, law.friction * stiffness * x};
  response.slope[1] = {-turning * x * y, turning * x * x, law.friction * stiffness * y};
}

void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  response = {};
  response.regime = regime;
  if (regime == Regime::open) return;
  const double stiffness = 1.0 / law.normal_softness;
  press(miss[2] * stiffness, stiffness, response);
  if (law.friction == 0.0) return;
  const double slip = slip_of(miss);
  if (regime == Regime::sticks) return stick(law, miss, response);
  if (slip > 0.0) slide(law, miss, slip, response);
}

}  // namespace energymargin

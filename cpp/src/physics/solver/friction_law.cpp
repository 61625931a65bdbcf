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
  if (!(miss[2] > 0.0)) return respond_as(Regime::open, law, miss, response);
  const double most = law.friction * miss[2] / law.normal_softness;
  const bool sticks = slip_of(miss) <= most * law.tangential_softness;
  respond_as(sticks ? Regime::sticks : Regime::slides, law, miss, response);
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

#include "physics/native/friction_law.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// Calls visit(row) for the tangential rows.
template <typename Visit>
void for_each_tangential(const FrictionLaw& law, const Visit& visit) {
  visit(std::size_t{0});
  visit(std::size_t{1});
  for (std::size_t row = usual_rows; row < static_cast<std::size_t>(law.rows); ++row) visit(row);
}

double squared_slip(const FrictionLaw& law, const ContactVector& miss) {
  double sum = 0.0;
  for_each_tangential(law, [&](std::size_t row) { sum += miss[row] * miss[row]; });
  return sum;
}

void open(ContactResponse& response) {
  response.regime = Regime::open;
  response.impulse = {};
}

// Only the rows that count; most contacts have few.
void clear(const FrictionLaw& law, ContactVector& slope) {
  slope[0] = slope[1] = slope[2] = 0.0;
  for (std::size_t row = usual_rows; row < static_cast<std::size_t>(law.rows); ++row) slope[row] = 0.0;
}

// The response along the normal.
void press(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double stiffness = 1.0 / law.normal_softness;
  response.impulse[2] = miss[2] * stiffness;
  clear(law, response.slope[2]);
  response.slope[2][2] = stiffness;
}

void stick(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double stiffness = law.friction > 0.0 ? 1.0 / law.tangential_softness : 0.0;
  response.regime = Regime::sticks;
  press(law, miss, response);
  for_each_tangential(law, [&](std::size_t row) {
    response.impulse[row] = miss[row] * stiffness;
    clear(law, response.slope[row]);
    response.slope[row][row] = stiffness;
  });
}

// Friction at `most` [N s] along the slip. As the slip turns, so does the friction; as the contact presses more, it
// grows by `by_normal` of that.
void slide_along(const FrictionLaw& law, const ContactVector& miss, double slip, double most, double by_normal,
                 ContactResponse& response) {
  response.regime = Regime::slides;
  const double inverse = 1.0 / slip, turning = most * inverse;
  if (law.rows == usual_rows) {
    const double x = miss[0] * inverse, y = miss[1] * inverse;
    response.impulse[0] = most * x;
    response.impulse[1] = most * y;
    ContactVector &of_x = response.slope[0], &of_y = response.slope[1];
    of_x[0] = turning * y * y;
    of_x[1] = of_y[0] = -turning * x * y;
    of_x[2] = by_normal * x;
    of_y[1] = turning * x * x;
    of_y[2] = by_normal * y;
    return;
  }
  for_each_tangential(law, [&](std::size_t row) {
    const double along = miss[row] * inverse;
    response.impulse[row] = most * along;
    for_each_tangential(law, [&](std::size_t column) {
      response.slope[row][column] = turning * ((row == column ? 1.0 : 0.0) - along * miss[column] * inverse);
    });
    response.slope[row][normal_row] = by_normal * along;
  });
}

FrictionLaw without_friction(FrictionLaw law) {
  law.friction = 0.0;
  return law;
}

// Against the slip.
void slide(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double slip = std::sqrt(squared_slip(law, miss));
  if (!(slip > 0.0)) return stick(law, miss, response);
  press(law, miss, response);
  const double most = std::max(0.0, law.friction * response.impulse[2]);
  slide_along(law, miss, slip, most, law.friction * response.slope[2][2], response);
}

}  // namespace

void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (!(miss[2] > 0.0)) return open(response);
  const double most = law.friction * miss[2] * law.tangential_softness;
  const double slips = law.normal_softness * law.normal_softness * squared_slip(law, miss);
  if (slips > most * most && law.friction > 0.0) return slide(law, miss, response);
  stick(law, miss, response);
}

void tresca(const FrictionLaw& law, const ContactVector& miss, double bound, ContactResponse& response) {
  const bool presses = miss[normal_row] > 0.0;
  if (!(bound > 0.0) || !(law.friction > 0.0)) {
    return presses ? respond_as(Regime::sticks, without_friction(law), miss, response) : open(response);
  }
  stick(law, miss, response);
  if (!presses) response.impulse[normal_row] = response.slope[normal_row][normal_row] = 0.0;
  const double slip = std::sqrt(squared_slip(law, miss));
  if (slip > bound * law.tangential_softness) slide_along(law, miss, slip, bound, 0.0, response);
}

void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (regime == Regime::open) return open(response);
  if (regime == Regime::sticks || !(law.friction > 0.0)) return stick(law, miss, response);
  slide(law, miss, response);
}

}  // namespace energymargin

#include "physics/solver/friction_law.hpp"

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

ContactVector scaled(const FrictionLaw& law, const ContactVector& miss, double factor) {
  ContactVector product{};
  for_each_tangential(law, [&](std::size_t row) { product[row] = miss[row] * factor; });
  return product;
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

// The same law as in two dimensions, below, in as many as it takes: the slope is turning (1 - along along').
void slide_and_twist(const FrictionLaw& law, const ContactVector& miss, const ContactVector& along, double most,
                     double turning, ContactResponse& response) {
  double part = 0.0;
  for_each_tangential(law, [&](std::size_t row) { part += along[row] * miss[row]; });
  for_each_tangential(law, [&](std::size_t row) {
    response.impulse[row] = most * along[row] + turning * (miss[row] - part * along[row]);
    for_each_tangential(law, [&](std::size_t column) {
      response.slope[row][column] = turning * ((row == column ? 1.0 : 0.0) - along[row] * along[column]);
    });
    response.slope[row][normal_row] = law.friction * response.slope[normal_row][normal_row] * along[row];
  });
}

void slide_in_plane(const FrictionLaw& law, const ContactVector& miss, double x, double y, double turning,
                    ContactResponse& response) {
  response.regime = Regime::slides;
  press(law, miss, response);
  const double most = law.friction * response.impulse[2];
  const double across = turning * (y * miss[0] - x * miss[1]);
  const double by_normal = law.friction * response.slope[2][2];
  response.impulse[0] = most * x + y * across;
  response.impulse[1] = most * y - x * across;
  ContactVector &of_x = response.slope[0], &of_y = response.slope[1];
  of_x[0] = turning * y * y;
  of_x[1] = of_y[0] = -turning * x * y;
  of_x[2] = by_normal * x;
  of_y[1] = turning * x * x;
  of_y[2] = by_normal * y;
}

// Friction at its limit along a unit vector, which turns towards the miss by that much.
void slide(const FrictionLaw& law, const ContactVector& miss, const ContactVector& along, double turning,
           ContactResponse& response) {
  if (law.rows == usual_rows) return slide_in_plane(law, miss, along[0], along[1], turning, response);
  response.regime = Regime::slides;
  press(law, miss, response);
  slide_and_twist(law, miss, along, law.friction * response.impulse[2], turning, response);
}

// Against the slip.
void slide(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  const double slip = std::sqrt(squared_slip(law, miss));
  if (!(slip > 0.0)) return stick(law, miss, response);
  const double inverse = 1.0 / slip;
  const double most = std::max(0.0, law.friction * miss[2] / law.normal_softness);
  if (law.rows == usual_rows) {
    return slide_in_plane(law, miss, miss[0] * inverse, miss[1] * inverse, most * inverse, response);
  }
  slide(law, miss, scaled(law, miss, inverse), most * inverse, response);
}

}  // namespace

void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (!(miss[2] > 0.0)) return open(response);
  const double most = law.friction * miss[2] * law.tangential_softness;
  const double slips = law.normal_softness * law.normal_softness * squared_slip(law, miss);
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
  ContactVector asked{};
  for_each_tangential(law, [&](std::size_t row) {
    asked[row] = impulse[row] + weight * (miss[row] - law.tangential_softness * impulse[row]);
  });
  const double length = std::sqrt(squared_slip(law, asked));
  const double most = law.friction * std::max(0.0, impulse[2]);
  if (length <= most) return stick(law, miss, response);
  const double turning = std::min(most * weight / (length - most), 1.0 / law.tangential_softness);
  for_each_tangential(law, [&](std::size_t row) { asked[row] /= length; });
  slide(law, miss, asked, turning, response);
}

void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response) {
  if (regime == Regime::open) return open(response);
  if (regime == Regime::sticks || !(law.friction > 0.0)) return stick(law, miss, response);
  slide(law, miss, response);
}

}  // namespace energymargin

#pragma once
// Coulomb's law at one contact point, as a function of the relative velocity there.

#include <array>

namespace energymargin {

//! Two tangential numbers and the normal one.
using ContactVector = std::array<double, 3>;

//! A contact resists by impulse = miss / softness, as far as the cone |tangential| <= friction * normal allows. `miss`
//! is what the velocity should be minus what it is [m/s]; softness [m/s per N s] is so small that it only makes the
//! impulses of redundant points unique.
struct FrictionLaw {
  double friction = 0.0;
  double tangential_softness = 0.0;
  double normal_softness = 0.0;
};

//! Impulse at a miss, and how it grows with it.
struct ContactResponse {
  ContactVector impulse{};               // [N s]
  std::array<ContactVector, 3> slope{};  // d impulse / d miss [kg]; all zero: the contact is open
  bool open = true;
};

//! Coulomb's law itself. The slope is not symmetric where the contact slides: friction follows the normal impulse, and
//! not the other way round.
void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response);

//! The convex law: the impulse is the projection of miss / softness onto the cone, in the norm of the softness, and
//! the gradient of `convex_cost`. It lifts what slides by friction * slip, so the normal miss is taken less by `shift`
//! [m/s]: where that is friction * slip, both laws agree (De Saxce and Feng 1998).
void convex(const FrictionLaw& law, const ContactVector& miss, double shift, ContactResponse& response);

//! Its shift for a miss.
double shift_of(const FrictionLaw& law, const ContactVector& miss);

}  // namespace energymargin

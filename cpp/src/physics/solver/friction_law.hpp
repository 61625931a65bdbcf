#pragma once
// Coulomb's law at one contact point, as a function of the relative velocity there.

#include <array>

namespace energymargin {

//! Two tangential numbers and the normal one.
using ContactVector = std::array<double, 3>;

//! A contact resists by impulse = miss / softness, as far as Coulomb's cone |tangential| <= friction * normal allows.
//! `miss` is what the velocity should be minus what it is [m/s]; softness [m/s per N s] is so small that it only makes
//! the impulses of redundant points unique.
struct FrictionLaw {
  double friction = 0.0;
  double tangential_softness = 0.0;
  double normal_softness = 0.0;
};

//! What a contact does.
enum class Regime { open, sticks, slides };

//! Impulse at a miss, and how it grows with it. The slope is not symmetric where the contact slides: friction follows
//! the normal impulse, and not the other way round.
struct ContactResponse {
  ContactVector impulse{};               // [N s]
  std::array<ContactVector, 3> slope{};  // d impulse / d miss [kg]
  Regime regime = Regime::open;
};

//! Coulomb's law.
void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response);

//! The response if the contact goes on in a regime: on paper it may pull, or stick beyond its cone.
void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response);

}  // namespace energymargin

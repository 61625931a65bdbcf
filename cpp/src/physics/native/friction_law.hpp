#pragma once
// Coulomb's law at one contact point, as a function of the relative velocity there: law (1) of
// docs/engineering/contact.md#the-law, and Tresca's.

#include <array>

namespace energymargin {

//! Rows of a contact: two along its plane, its normal and, of some, one about that and two about the plane's axes.
inline constexpr int normal_row = 2;
inline constexpr int usual_rows = 3;
inline constexpr int most_rows = 6;

//! A number for each row of a contact.
using ContactVector = std::array<double, most_rows>;

//! impulse = miss / softness within the cone |tangential| <= friction * normal, where all rows but the normal one are
//! tangential: those about an axis are scaled so that they share the cone. `miss` is what the velocity should be
//! minus what it is [m/s]; softness is in m/s per N s.
struct FrictionLaw {
  //! Softness, as shares of what a unit impulse changes along a row.
  static constexpr double normal_share = 1e-3;
  static constexpr double tangential_share = 5e-4;

  double friction = 0.0;
  double tangential_softness = 0.0;
  double normal_softness = 0.0;
  int rows = usual_rows;   // that count
  bool compliant = false;  // its normal softness is a property of the bodies
};

//! What a contact does.
enum class Regime { open, sticks, slides };

//! Impulse at a miss, and how it grows with it. The slope is not symmetric where the contact slides: friction follows
//! the normal impulse, and not the other way round.
struct ContactResponse {
  ContactVector impulse{};                     // [N s]
  std::array<ContactVector, most_rows> slope;  // d impulse / d miss [kg]; unset where the contact is open
  Regime regime = Regime::open;
};

//! Coulomb's law.
void coulomb(const FrictionLaw& law, const ContactVector& miss, ContactResponse& response);

//! Tresca's law: friction is at most `bound` [N s], whatever presses. Impulses are then the slope of a convex cost of
//! the miss, so that one velocity has them all.
void tresca(const FrictionLaw& law, const ContactVector& miss, double bound, ContactResponse& response);

//! The response if the contact goes on in a regime: on paper it may pull, or stick beyond its cone.
void respond_as(Regime regime, const FrictionLaw& law, const ContactVector& miss, ContactResponse& response);

}  // namespace energymargin

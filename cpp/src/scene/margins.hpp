#pragma once
// How thick the rounded border of a solid is, and how deep two solids may be in each other. Contacts and proofs of
// cages hold the same.

#include <algorithm>
#include <optional>

namespace energymargin {

//! Collision margin of a solid [m]: as asked for, up to half of its smallest half extent; else a twentieth of that.
//! Bullet's default of 4 cm would swallow a 10 cm box; a twentieth keeps GJK well conditioned at any scale.
inline double collision_margin(double smallest_half_extent, const std::optional<double>& asked) {
  constexpr double share = 0.05, most_share = 0.5;
  return asked ? std::min(*asked, most_share * smallest_half_extent) : share * smallest_half_extent;
}

//! How deep the simulation lets one solid come into another [m]; `margins` is the sum of both.
inline double allowed_penetration(double margins, double half_extent_a, double half_extent_b) {
  constexpr double share_of_margins = 0.7, share_of_thickness = 0.3;  // of the thinner one's half extent
  return std::min(share_of_margins * margins, share_of_thickness * std::min(half_extent_a, half_extent_b));
}

}  // namespace energymargin

#pragma once
// How deep in each other two bodies may be at a start.

#include <algorithm>

#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

// A share of the smaller body's smallest half extent. A simulation that hits a wall at 1.5 m/s is 6 mm in it after one
// step.
constexpr double deep = 0.25;

//! Of the two bodies of a contact [m].
inline double most_penetration(const Scene& scene, const Contact& contact) {
  return deep * std::min(smallest_half_extent(scene.body(contact.body_a).shape),
                         smallest_half_extent(scene.body(contact.body_b).shape));
}

}  // namespace energymargin

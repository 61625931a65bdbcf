#pragma once
// What a penetration is measured by.

#include <algorithm>

#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! The smaller one of the smallest half extents of the two bodies of a contact [m].
inline double smaller_half_extent(const Scene& scene, const Contact& contact) {
  return std::min(scene.smallest_half_extent(scene.index(contact.body_a)),
                  scene.smallest_half_extent(scene.index(contact.body_b)));
}

}  // namespace energymargin

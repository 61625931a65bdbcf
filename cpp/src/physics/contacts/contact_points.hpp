#pragma once
// The contacts of a step as the library tells them.

#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"
#include "physics/contacts/contact_point.hpp"

namespace energymargin {

//! With the forces of a part of `duration` [s].
std::vector<Contact> contact_points(const std::vector<ContactPoint>& points, const Scene& scene, double duration);

}  // namespace energymargin

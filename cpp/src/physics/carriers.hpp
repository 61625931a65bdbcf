#pragma once
// Which bodies go along with a kinematic one in time that is lost.

#include <vector>

#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/contact_point.hpp"

namespace energymargin {

//! A kinematic body loses no time. What it touches, or what touches that, goes along with it for `lost` [s]: it pushes,
//! and passes only what something else holds. Each body has at most one carrier. `ways` are the velocities of all
//! bodies.
void carry_along(const Scene& scene, MovingBodies& bodies, const std::vector<ContactPoint>& points,
                 const std::vector<Velocity>& ways, double lost);

}  // namespace energymargin

#pragma once
// Patches of soft surfaces: what presses on one does so over an area, and friction acts on all of it.

#include <vector>

#include "physics/contacts/face_contacts.hpp"

namespace energymargin {

//! Friction at the contacts of two solids is that of an even pressure, over what these points share and over a disc of
//! that radius at least [m]: it acts in the middle of them, and about it with the mean distance from there as `lever`.
void spread(std::vector<FacePoint>& points, const btVector3& normal, double radius);

}  // namespace energymargin

#pragma once
// What a body is about to sweep.

#include <optional>

#include "energymargin/kinematics.hpp"
#include "energymargin/region.hpp"

namespace energymargin {

//! How a body moves in x and y.
regions::PlanarMotion planar_motion(const BodyState& body);

//! The annular sector about the instantaneous centre of rotation; none while the body is too slow: then it is the disc.
std::optional<regions::AnnularSector> swept_sector(const regions::Swept& swept, const regions::PlanarMotion& motion);

}  // namespace energymargin

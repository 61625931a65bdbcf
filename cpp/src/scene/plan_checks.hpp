#pragma once
// What a plan may be, for those who call its wrenches otherwise.

#include <string>

#include "energymargin/plan.hpp"
#include "energymargin/scene.hpp"

namespace energymargin {

//! As validate(plan, scene); errors name its wrenches `wrenches`.
void validate(const Plan& plan, const Scene& scene, const std::string& wrenches);

}  // namespace energymargin

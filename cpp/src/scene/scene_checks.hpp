#pragma once
// What bodies, joints and springs may be, each alone. Each throws std::invalid_argument.

#include <memory>
#include <vector>

#include "energymargin/scene.hpp"
#include "scene/body_constants.hpp"

namespace energymargin {

//! Its constants, which some of the checks need.
std::shared_ptr<const BodyConstants> validate_body(const Body& body);

void validate_joint(const Joint& joint);
void validate_tendon(const Tendon& tendon);

//! How far a position is beyond a limit of the joint [rad] or [m]; 0 if that is no more than a simulated joint yields.
double beyond_limits(const Joint& joint, double position);

//! A spring between `a` and `b`, beside `others`, is soft enough for steps of this length [s].
void validate_spring(const Spring& spring, const Body& a, const Body& b, const std::vector<Spring>& others,
                     double step);

}  // namespace energymargin

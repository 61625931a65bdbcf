#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "energymargin/plausible.hpp"
#include "energymargin/state.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin {
namespace {

void validate_mimic(const Joint& joint) {
  const Mimic& mimic = *joint.mimic;
  require_finite("mimic multiplier", mimic.multiplier);
  require_finite("mimic offset", mimic.offset);
  if (mimic.multiplier == 0.0) reject("mimic multiplier", "0", "another number, or a joint of type fixed");
  if (joint.type == JointType::fixed) reject("mimic", "given", "none: the joint is fixed");
  if (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0) {
    reject("stiffness, damping or held", "given", "none of them: the joint follows '" + mimic.joint + "'");
  }
  if (joint.state.position != 0.0 || joint.state.velocity != 0.0) {
    reject("position and velocity", "not 0", "0: the joint follows '" + mimic.joint + "'");
  }
  if (std::isfinite(joint.lower) || std::isfinite(joint.upper)) {
    reject("limits", "given", "none: the joint follows '" + mimic.joint + "', and stops where that one does");
  }
}

}  // namespace

double beyond_limits(const Joint& joint, double position) {
  const double slack = joint.type == JointType::revolute ? plausible::stop_angle : plausible::stop_length;
  const double beyond = std::max(joint.lower - position, position - joint.upper);
  return beyond > slack ? beyond : 0.0;
}

void validate_joint(const Joint& joint) {
  if (joint.name.empty()) reject("name", "empty", "a name that no other joint has");
  for (const auto& [name, pose] : {std::pair{"in_parent", joint.in_parent}, {"in_child", joint.in_child}}) {
    require_finite(std::string(name) + " position", pose.position);
    require_unit(std::string(name) + " orientation", pose.orientation);
  }
  require_unit("axis", joint.axis);
  if (!(joint.lower < joint.upper)) {
    reject("lower limit", text(joint.lower), "a number below the upper limit, " + text(joint.upper));
  }
  if (joint.type == JointType::fixed && (joint.state.position != 0.0 || joint.state.velocity != 0.0)) {
    reject("position and velocity", "not 0", "0: the joint is fixed");
  }
  require_not_negative("armature", joint.armature);
  if (joint.armature != 0.0 && !joint.moves()) {
    reject("armature", text(joint.armature), "0: the joint is fixed, or follows another one");
  }
  if (joint.type == JointType::fixed && (joint.held || joint.stiffness != 0.0 || joint.damping != 0.0)) {
    reject("stiffness, damping or held", "given", "none of them: the joint is fixed");
  }
  validate(joint, joint.state, "");
  if (beyond_limits(joint, joint.state.position) > 0.0) {
    reject("position", text(joint.state.position), "from " + text(joint.lower) + " to " + text(joint.upper));
  }
  for (const double limit : {joint.lower, joint.upper}) {
    if (joint.type != JointType::revolute || !std::isfinite(limit)) continue;
    if (std::abs(limit) > plausible::refused_angle) {
      reject("limits", text(limit), "angles of at most " + text(plausible::refused_angle) + " rad, or inf for none");
    }
  }
  require_finite("target", joint.target);
  require_finite("target_velocity", joint.target_velocity);
  require_not_negative("stiffness", joint.stiffness);
  require_not_negative("damping", joint.damping);
  if (joint.mimic) validate_mimic(joint);
  if (!(joint.torque_limit >= 0.0)) reject("torque_limit", text(joint.torque_limit), "a number of at least 0");
}

}  // namespace energymargin

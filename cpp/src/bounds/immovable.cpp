#include "bounds/immovable.hpp"

namespace energymargin::bounds {
namespace {

bool at_rest(const Problem& problem, std::size_t body) {
  const BodyState at = StateLayout::read(problem.state.data() + StateLayout(problem.scene).offset(body));
  return at.velocity.isZero(0.0) && at.angular_velocity.isZero(0.0);
}

bool stays(const Problem& problem, std::size_t body) {
  const Scene& scene = problem.scene;
  if (const auto above = scene.joint_to(body)) {
    const Joint& joint = scene.joints()[*above];
    const bool rigid = joint.type == JointType::fixed || (joint.held && !joint.mimic && !problem.plan);
    return rigid && stays(problem, scene.index(joint.parent));
  }
  const Body& of = scene.bodies()[body];
  if (of.kinematic) return !problem.plan && at_rest(problem, body);
  return of.fixed() || (of.linear_factor.isZero(0.0) && of.angular_factor.isZero(0.0));
}

}  // namespace

std::vector<bool> immovable_bodies(const Problem& problem) {
  std::vector<bool> immovable;
  for (std::size_t body = 0; body < problem.scene.bodies().size(); ++body) immovable.push_back(stays(problem, body));
  return immovable;
}

}  // namespace energymargin::bounds

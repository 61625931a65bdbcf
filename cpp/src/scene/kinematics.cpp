#include "energymargin/kinematics.hpp"

#include "base/portable.hpp"

namespace energymargin {

BodyState child_state(const Joint& joint, const JointState& state, const BodyState& parent) {
  const Quaternion frame = parent.orientation * joint.in_parent.orientation;
  const Vector3 axis = frame * joint.axis;
  const bool turns = joint.type == JointType::revolute;
  const bool slides = joint.type == JointType::prismatic;
  const double angle = turns ? state.position : 0.0;
  const Vector3 slide = slides ? Vector3(axis * state.position) : Vector3::Zero();

  BodyState child;
  const Quaternion turn = portable::turn(angle, joint.axis);
  child.orientation = (frame * turn * joint.in_child.orientation.conjugate()).normalized();
  const Vector3 arm_in_parent = parent.orientation * joint.in_parent.position + slide;
  const Vector3 arm_in_child = child.orientation * joint.in_child.position;
  child.position = parent.position + arm_in_parent - arm_in_child;
  child.angular_velocity = parent.angular_velocity;
  child.velocity = parent.velocity + parent.angular_velocity.cross(arm_in_parent);
  if (turns) child.angular_velocity += axis * state.velocity;
  if (slides) child.velocity += axis * state.velocity;
  child.velocity -= child.angular_velocity.cross(arm_in_child);
  return child;
}

BodyState state_at_point(const Vector3& point, const BodyState& body) {
  if (point.isZero(0.0)) return body;
  const Vector3 arm = body.orientation * point;
  return {body.position + arm, body.orientation, body.velocity + body.angular_velocity.cross(arm),
          body.angular_velocity};
}

Kinematics::Kinematics(const Scene& scene) : layout_(scene) {
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    Node node{scene.bodies()[i].state, layout_.offset(i), std::nullopt, 0, 0};
    if (const auto joint = scene.joint_to(i)) {
      node.joint = scene.joints()[*joint];
      node.joint_index = *joint;
      node.parent = scene.index(node.joint->parent);
    }
    nodes_.push_back(std::move(node));
  }
}

BodyState Kinematics::operator()(const double* state, std::size_t body) const {
  const Node& node = nodes_[body];
  if (node.offset >= 0) return StateLayout::read(state + node.offset);
  if (!node.joint) return node.fixed;
  return child_state(*node.joint, layout_.joint(state, node.joint_index), (*this)(state, node.parent));
}

}  // namespace energymargin

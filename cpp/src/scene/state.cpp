#include "energymargin/state.hpp"

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"

namespace energymargin {

StateLayout::StateLayout(const Scene& scene) {
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const bool free = !scene.bodies()[i].fixed() && !scene.joint_to(i);
    offsets_.push_back(free ? dimension_ : -1);
    if (free) dimension_ += numbers_per_body;
  }
  for (const Joint& joint : scene.joints()) {
    joints_.emplace_back();
    if (!joint.moves()) continue;
    joints_.back().offset = dimension_;
    dimension_ += numbers_per_joint;
  }
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    if (const auto& mimic = scene.joints()[i].mimic) {
      joints_[i] = {joints_[scene.joint_index(mimic->joint)].offset, mimic->multiplier, mimic->offset, true};
    }
  }
  for (const Tendon& tendon : scene.tendons()) {
    tendons_.emplace_back();
    for (const TendonJoint& of : tendon.joints) {
      tendons_.back().emplace_back(scene.joint_index(of.joint), of.coefficient);
    }
  }
}

JointState StateLayout::tendon(const double* numbers, std::size_t tendon) const {
  JointState sum;
  for (const auto& [index, coefficient] : tendons_[tendon]) {
    const JointState at = joint(numbers, index);
    sum.position += coefficient * at.position;
    sum.velocity += coefficient * at.velocity;
  }
  return sum;
}

JointState StateLayout::joint(const double* numbers, std::size_t joint) const {
  const JointNumbers& of = joints_[joint];
  if (of.offset < 0) return {};
  const JointState read{numbers[of.offset], numbers[of.offset + 1]};
  return of.follows ? JointState{of.multiplier * read.position + of.shift, of.multiplier * read.velocity} : read;
}

BodyState StateLayout::read(const double* numbers) {
  using Block = Eigen::Map<const Vector3>;
  return {Block(numbers), Quaternion(numbers[6], numbers[3], numbers[4], numbers[5]), Block(numbers + 7),
          Block(numbers + 10)};
}

void StateLayout::write(const BodyState& body, double* numbers) {
  Eigen::Map<Eigen::Matrix<double, numbers_per_body, 1>> all(numbers);
  all << body.position, body.orientation.coeffs(), body.velocity, body.angular_velocity;
}

State pack(const Scene& scene, const std::map<std::string, BodyState>& bodies,
           const std::map<std::string, JointState>& joints) {
  const StateLayout layout(scene);
  State state(layout.dimension());
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) >= 0) StateLayout::write(scene.bodies()[i].state, state.data() + layout.offset(i));
  }
  const auto write_joint = [&](std::size_t joint, const JointState& at) {
    state.segment<StateLayout::numbers_per_joint>(layout.joint_offset(joint)) << at.position, at.velocity;
  };
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    if (scene.joints()[i].moves()) write_joint(i, scene.joints()[i].state);
  }
  for (const auto& [name, body] : bodies) {
    const std::size_t index = scene.index(name);
    const int offset = layout.offset(index);
    if (offset < 0) {
      reject("body", "'" + name + "'",
             scene.joint_to(index) ? "a body that no joint carries; this one follows from the joints"
                                   : "a body that can move; this one is fixed");
    }
    validate(scene.body(name), body, name + ": ");
    StateLayout::write(body, state.data() + offset);
  }
  for (const auto& [name, joint] : joints) {
    const std::size_t index = scene.joint_index(name);
    if (!scene.joints()[index].moves()) {
      reject("joint", "'" + name + "'",
             std::string("a joint that moves by itself; this one ") +
                 (scene.joints()[index].mimic ? "follows another" : "is fixed"));
    }
    validate(scene.joints()[index], joint, "joint '" + name + "': ");
    write_joint(index, joint);
  }
  return state;
}

Unpacked unpack(const Scene& scene, const State& state) {
  validate(scene, state);
  const StateLayout layout(scene);
  const Kinematics kinematics(scene);
  Unpacked unpacked;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (!scene.bodies()[i].fixed()) unpacked.bodies[scene.bodies()[i].name] = kinematics(state.data(), i);
  }
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    const Joint& joint = scene.joints()[i];
    if (joint.type != JointType::fixed) unpacked.joints[joint.name] = layout.joint(state.data(), i);
  }
  return unpacked;
}

void validate(const Body& body, const BodyState& state, const std::string& name) {
  require_finite(name + "position", state.position);
  require_finite(name + "velocity", state.velocity);
  require_finite(name + "angular_velocity", state.angular_velocity);
  require_unit(name + "orientation", state.orientation);
  const auto locked = [](const Vector3& factor, const Vector3& v, double slack) {
    return ((factor.array() == 0.0) && (v.array().abs() > slack)).any();
  };
  if (body.linear_factor != Vector3::Ones()) {
    // The centre of mass is what is locked; where the frame lies elsewhere, its velocity is rounded.
    const Vector3 center = body.principal_inertial().center;
    const double slack = center.isZero(0.0) ? 0.0 : 1e-9 * (1.0 + state.angular_velocity.norm() * center.norm());
    if (locked(body.linear_factor, state_at_point(center, state).velocity, slack)) {
      reject(name + "velocity", text(state.velocity), "0 along locked axes");
    }
  }
  if (locked(body.angular_factor, state.angular_velocity, 0.0)) {
    reject(name + "angular_velocity", text(state.angular_velocity), "0 about locked axes");
  }
  if (body.fixed() && (!state.velocity.isZero(0.0) || !state.angular_velocity.isZero(0.0))) {
    reject(name + "velocity", text(state.velocity), "0: the body is fixed");
  }
}

void validate(const Joint& joint, const JointState& state, const std::string& name) {
  require_finite(name + "position", state.position);
  require_finite(name + "velocity", state.velocity);
  if (joint.held && state.velocity != 0.0) reject(name + "velocity", text(state.velocity), "0: the joint is held");
}

void validate(const Scene& scene, const State& state, const std::string& name) {
  const StateLayout layout(scene);
  if (state.size() != layout.dimension()) {
    reject(name, "a vector of " + std::to_string(state.size()) + " numbers",
           std::to_string(layout.dimension()) + " numbers, 13 for each free body and 2 for each joint");
  }
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) < 0) continue;
    const Body& body = scene.bodies()[i];
    validate(body, StateLayout::read(state.data() + layout.offset(i)), name + ": body '" + body.name + "': ");
  }
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    const int offset = layout.joint_offset(i);
    if (offset < 0) continue;
    const Joint& joint = scene.joints()[i];
    validate(joint, {state[offset], state[offset + 1]}, name + ": joint '" + joint.name + "': ");
  }
}

}  // namespace energymargin

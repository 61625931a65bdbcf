#pragma once
// The mechanical energy of a scene.

#include <algorithm>
#include <cmath>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/scene.hpp"

namespace energymargin {

//! Of a joint's compliance, zero at its target [J]. Beyond the torque limit its slope stays.
inline double compliance_energy(const PositionControl& control, double position) {
  if (control.stiffness == 0.0) return 0.0;
  const double away = std::abs(control.target - position);
  const double linear = std::min(away, control.torque_limit / control.stiffness);
  return 0.5 * control.stiffness * linear * linear + (away > linear ? control.torque_limit * (away - linear) : 0.0);
}

//! E of eq. 3: kinetic energy of all bodies that forces move, links included; potential energy of gravity and the
//! constant forces, zero at the world's origin; of the springs; and of the joints' compliance, zero at their targets.
class Energy {
 public:
  explicit Energy(const Scene& scene) : scene_(scene), layout_(scene), kinematics_(scene) {
    for (std::size_t body = 0; body < scene.bodies().size(); ++body) {
      if (layout_.offset(body) < 0) continue;
      for (int i = 0; i < 6; ++i) velocities_.push_back(layout_.offset(body) + StateLayout::velocities_of_body + i);
    }
    for (std::size_t joint = 0; joint < scene.joints().size(); ++joint) {
      if (layout_.joint_offset(joint) >= 0) velocities_.push_back(layout_.joint_offset(joint) + 1);
    }
  }

  //! [J]; the state is taken as valid.
  double operator()(const State& state) const {
    double energy = 0.0;
    for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
      if (scene_.bodies()[i].dynamic()) energy += of_body(i, kinematics_(state.data(), i));
    }
    for (const Spring& spring : scene_.springs()) energy += of_spring(spring, state);
    for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
      const JointState at = layout_.joint(state.data(), i);
      if (!scene_.joints()[i].held) energy += compliance_energy(scene_.joints()[i], at.position);
      energy += 0.5 * scene_.joints()[i].armature * at.velocity * at.velocity;
    }
    for (std::size_t i = 0; i < scene_.tendons().size(); ++i) {
      energy += compliance_energy(scene_.tendons()[i], layout_.tendon(state.data(), i).position);
    }
    return energy;
  }

  //! The kinetic part of it, as a frame sees it that moves with the velocities of `frame`, body by body [J].
  double kinetic(State state, const State& frame) const {
    for (const Eigen::Index i : velocities_) state[i] -= frame[i];
    const double moving = (*this)(state);
    for (const Eigen::Index i : velocities_) state[i] = 0.0;
    return moving - (*this)(state);
  }

  //! Power of gravity, the constant forces and the springs' stiffness on the bodies [W].
  double power(const State& state) const {
    double power = 0.0;
    for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
      const Body& body = scene_.bodies()[i];
      if (!body.dynamic()) continue;
      const BodyState at = state_at_point(scene_.inertial(i).center, kinematics_(state.data(), i));
      power += (body.mass * scene_.gravity() + body.force).dot(at.velocity);
    }
    for (const Spring& spring : scene_.springs()) power += power_of(spring, state);
    return power;
  }

 private:
  double of_body(std::size_t body, const BodyState& frame) const {
    const double mass = scene_.bodies()[body].mass;
    const Inertial& inertial = scene_.inertial(body);
    const BodyState at = state_at_point(inertial.center, frame);
    const Vector3 spin = (at.orientation * inertial.axes).conjugate() * at.angular_velocity;
    return 0.5 * mass * at.velocity.squaredNorm() + 0.5 * spin.dot(inertial.moments.cwiseProduct(spin)) -
           (mass * scene_.gravity() + scene_.bodies()[body].force).dot(at.position);
  }
  double of_spring(const Spring& spring, const State& state) const {
    const BodyState a = kinematics_(state.data(), scene_.index(spring.body_a));
    const BodyState b = kinematics_(state.data(), scene_.index(spring.body_b));
    const Vector3 span = b.position + b.orientation * spring.point_b - a.position - a.orientation * spring.point_a;
    const double stretch = span.norm() - spring.rest_length;
    return 0.5 * spring.stiffness * stretch * stretch;
  }
  double power_of(const Spring& spring, const State& state) const {
    const BodyState a = state_at_point(spring.point_a, kinematics_(state.data(), scene_.index(spring.body_a)));
    const BodyState b = state_at_point(spring.point_b, kinematics_(state.data(), scene_.index(spring.body_b)));
    const Vector3 span = b.position - a.position;
    const double length = span.norm();
    if (length == 0.0) return 0.0;  // it pulls nowhere
    return -spring.stiffness * (length - spring.rest_length) * span.dot(b.velocity - a.velocity) / length;
  }

  Scene scene_;
  StateLayout layout_;
  Kinematics kinematics_;
  std::vector<Eigen::Index> velocities_;  // where they are in a state
};

}  // namespace energymargin

#include "quasistatic/potential.hpp"

#include <algorithm>

#include "energymargin/kinematics.hpp"

namespace energymargin::quasistatic {

Potential::Potential(const Scene& scene, const State& state, std::size_t body)
    : load_(scene.bodies()[body].mass * scene.gravity() + scene.bodies()[body].force),
      center_(scene.inertial(body).center) {
  const Kinematics kinematics(scene);
  for (const Spring& spring : scene.springs()) {
    const std::size_t a = scene.index(spring.body_a);
    const std::size_t b = scene.index(spring.body_b);
    if (a != body && b != body) continue;
    const BodyState other = kinematics(state.data(), a == body ? b : a);
    const Vector3 anchor = other.position + other.orientation * (a == body ? spring.point_b : spring.point_a);
    springs_.push_back({a == body ? spring.point_a : spring.point_b, anchor, spring.stiffness, spring.rest_length});
  }
}

double Potential::operator()(const Pose& pose) const {
  double energy = -load_.dot(pose.position + pose.orientation * center_);
  for (const End& end : springs_) {
    const double stretch = (pose.position + pose.orientation * end.point - end.anchor).norm() - end.rest_length;
    energy += 0.5 * end.stiffness * stretch * stretch;
  }
  return energy;
}

bool Potential::turns() const {
  const auto off_origin = [](const End& end) { return !end.point.isZero(0.0); };
  return !center_.isZero(0.0) || std::any_of(springs_.begin(), springs_.end(), off_origin);
}

Vector3 Potential::force(const Pose& pose) const {
  Vector3 force = load_;
  for (const End& end : springs_) {
    const Vector3 span = pose.position + pose.orientation * end.point - end.anchor;
    const double length = span.norm();
    if (length > 0.0) force -= end.stiffness * (length - end.rest_length) / length * span;
  }
  return force;
}

}  // namespace energymargin::quasistatic

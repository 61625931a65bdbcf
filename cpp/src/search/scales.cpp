#include "search/scales.hpp"

#include <algorithm>
#include <cmath>

#include "energymargin/kinematics.hpp"

namespace energymargin::search {
namespace {

// Where nothing pushes, a longest edge counts as this share of an object's smallest half extent.
constexpr double smallest_reach = 0.01;

// Of the fastest part of the effector [m/s].
double effector_speed(const Problem& problem, const Kinematics& kinematics) {
  double speed = 0.0;
  for (const std::size_t effector : problem.scene.with_role(Role::effector)) {
    speed = std::max(speed, kinematics(problem.state.data(), effector).velocity.norm());
  }
  return speed;
}

}  // namespace

Scales::Scales(const Problem& problem, std::size_t index) {
  const Scene& scene = problem.scene;
  const Body& object = scene.bodies()[index];
  const Kinematics kinematics(scene);
  const BodyState start = kinematics(problem.state.data(), index);
  const double speed = effector_speed(problem, kinematics) + start.velocity.norm();
  const double time = problem.duration;
  const double acceleration = problem.force.norm() / object.mass;
  const double inertia = scene.inertial(index).moments.maxCoeff();
  const double angular_acceleration = problem.torque.norm() / inertia;
  const double radius_of_gyration = std::sqrt(inertia / object.mass);
  const double extent = scene.smallest_half_extent(index);
  const double radius = std::isfinite(extent) ? extent : radius_of_gyration;  // without parts it has none
  const double turning_radius = std::max(radius_of_gyration, radius);
  position = std::max(speed * time + 0.5 * acceleration * time * time, smallest_reach * radius);
  velocity = std::max(speed + acceleration * time, position / time);
  angular_velocity = start.angular_velocity.norm() + velocity / turning_radius + angular_acceleration * time;
  orientation =
      start.angular_velocity.norm() * time + position / turning_radius + 0.5 * angular_acceleration * time * time;
}

}  // namespace energymargin::search

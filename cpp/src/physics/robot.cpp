// A plan, as it goes.

#include <algorithm>
#include <limits>

#include "physics/engine.hpp"

namespace energymargin {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();  // force and torque, of a kinematic body

}  // namespace

Robot::Robot(const Scene& scene, const Plan& plan) : plan_(fine_rows(plan, scene.stepping().step)) {
  for (const Drive& drive : plan.wrenches) wrench_bodies_.push_back(scene.index(drive.body));
  for (const Targets& targets : plan.targets) joints_.push_back(scene.joint_index(targets.joint));
  for (Servo& servo : plan_.velocities) {
    servo = with_default_limits(scene, servo);
    servo_bodies_.push_back(scene.index(servo.body));
  }
}

void Robot::act(Simulation& simulation, int step) const {
  const int last = plan_.rows() - 1;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    simulation.set_target(joints_[i], plan_.targets[i].positions[std::min(step, last)]);
  }
  if (step > last) return;
  for (std::size_t i = 0; i < wrench_bodies_.size(); ++i) {
    const auto wrench = plan_.wrenches[i].wrenches.row(step);
    simulation.actuate({wrench_bodies_[i], vector(wrench.data()), vector(wrench.data() + 3)});
  }
  for (std::size_t i = 0; i < servo_bodies_.size(); ++i) {
    const Servo& servo = plan_.velocities[i];
    const auto velocity = servo.velocities.row(step);
    simulation.add_motor(servo_bodies_[i], velocity.head<3>(), velocity.tail<3>(), servo.force.value_or(unlimited),
                         servo.torque.value_or(unlimited));
  }
}

}  // namespace energymargin

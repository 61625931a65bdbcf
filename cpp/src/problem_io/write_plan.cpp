// Plans as JSON.

#include "problem_io/json.hpp"
#include "problem_io/packed.hpp"

namespace energymargin::problem_io {

OrderedJson write(const Plan& plan) {
  OrderedJson json = {{"step", plan.step}};
  for (const Drive& drive : plan.wrenches) {
    json["wrenches"].push_back({{"body", drive.body}, {"rows", pack(drive.wrenches)}});
  }
  for (const Targets& targets : plan.targets) {
    json["targets"].push_back({{"joint", targets.joint}, {"rows", pack(targets.positions)}});
  }
  for (const Servo& servo : plan.velocities) {
    OrderedJson motor = {{"body", servo.body}, {"rows", pack(servo.velocities)}};
    if (servo.force) motor["force"] = *servo.force;
    if (servo.torque) motor["torque"] = *servo.torque;
    json["velocities"].push_back(motor);
  }
  return json;
}

}  // namespace energymargin::problem_io

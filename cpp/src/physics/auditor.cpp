#include "physics/auditor.hpp"

#include <algorithm>

namespace energymargin {

Auditor::Auditor(Simulation& simulation, const Energy& energy)
    : simulation_(simulation), energy_(energy), length_rates_(simulation.scene().springs().size()) {
  const std::vector<Joint>& joints = simulation.scene().joints();
  for (std::size_t i = 0; i < joints.size() + simulation.scene().tendons().size(); ++i) {
    const bool moves = i >= joints.size() || (joints[i].moves() && !joints[i].held);
    if (moves && simulation.scene().control(i).drives()) controlled_.push_back(i);
  }
  simulation_.impulses() = {&before_, {}};
  simulation_.read(next_);
}

Auditor::~Auditor() { simulation_.impulses() = {}; }

void Auditor::begin() {
  simulation_.read(before_);
  const Scene& scene = simulation_.scene();
  held_.clear();
  for (const Load& load : simulation_.spring_loads()) {
    if (scene.bodies()[load.body].kinematic && !scene.jointed(load.body)) held_.push_back(load);
  }
  if (!simulation_.actuations().empty() || !held_.empty()) simulation_.read(velocities_);
  state_ = next_;
  for (std::size_t i = 0; i < length_rates_.size(); ++i) length_rates_[i] = simulation_.springs().span(i).length_rate;
}

void Auditor::end(const SubstepResult& substep) {
  simulation_.read(next_);
  add_actuations(substep.duration);
  const StateLayout& layout = simulation_.layout();
  for (const std::size_t i : controlled_) {
    add_control(i, layout.controlled(state_.data(), i), layout.controlled(next_.data(), i), substep.duration);
  }
  for (std::size_t i = 0; i < length_rates_.size(); ++i) {
    const double stretch = 0.5 * (length_rates_[i] + simulation_.springs().span(i).length_rate) * substep.duration;
    audit_.damping -= simulation_.scene().springs()[i].damping * length_rates_[i] * stretch;
  }
  // Velocities are a substep behind the positions; where motion is lost, its loads do no work.
  const double power = energy_.power(next_);
  audit_.integration -= 0.5 * substep.duration * (power - energy_.power(state_));
  audit_.overlap += power * substep.lost;
}

Audit Auditor::audit() const {
  Audit audit = audit_;
  const Audit& work = simulation_.impulses().work;
  audit.friction = work.friction;
  audit.contacts = work.contacts;
  audit.joints = work.joints;
  audit.damping += work.damping;
  audit.plan += work.plan;
  audit.overlap += work.overlap;
  audit.integration += work.integration;
  return audit;
}

// A kinematic body is held against its springs; one that carries links the solver holds.
void Auditor::add_actuations(double duration) {
  if (simulation_.actuations().empty() && held_.empty()) return;
  simulation_.read(next_velocities_);
  const auto power = [this](const Load& load) {
    return load.power(velocities_[load.body], next_velocities_[load.body]);
  };
  for (const Load& load : simulation_.actuations()) audit_.plan += power(load) * duration;
  for (const Load& load : held_) audit_.plan -= power(load) * duration;
}

// The torque of the control is that at the end of the step. What its compliance gives and takes should be what its
// energy loses and gains, which is about the scene's target: where the robot moves that, the rest is its work. What
// the torque limit leaves room for is damping and drive.
void Auditor::add_control(std::size_t index, const JointState& before, const JointState& after, double duration) {
  const PositionControl& control = simulation_.scene().control(index);
  const auto limited = [&](double torque) { return std::clamp(torque, -control.torque_limit, control.torque_limit); };
  const double spring = control.stiffness * (simulation_.target(index) - after.position);
  const double about_scene_target = control.stiffness * (control.target - after.position);
  const double damping = -control.damping * after.velocity;
  const double drive = control.damping * control.target_velocity;
  const double turned = 0.5 * (before.velocity + after.velocity) * duration;
  audit_.integration += limited(about_scene_target) * turned + compliance_energy(control, after.position) -
                        compliance_energy(control, before.position);
  audit_.plan += (limited(spring) - limited(about_scene_target)) * turned;
  const double moving = damping + drive;
  if (moving == 0.0) return;
  const double share = (limited(spring + moving) - limited(spring)) / moving;
  audit_.damping += share * damping * turned;
  audit_.drives += share * drive * turned;
}

}  // namespace energymargin

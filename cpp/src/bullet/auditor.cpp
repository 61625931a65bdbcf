#include "auditor.hpp"

#include <algorithm>

namespace energymargin {

Auditor::Auditor(Simulation& simulation, const Energy& energy)
    : simulation_(simulation), energy_(energy), growths_(simulation.scene().springs().size()) {
  const std::vector<Joint>& joints = simulation.scene().joints();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool control = joints[i].stiffness > 0.0 || joints[i].damping > 0.0;
    if (control && joints[i].moves() && !joints[i].held) controlled_.push_back(i);
  }
  simulation_.watch(&before_);
  simulation_.read(next_);
}

Auditor::~Auditor() { simulation_.watch(nullptr); }

void Auditor::begin() {
  simulation_.read(before_);
  state_ = next_;
  for (std::size_t i = 0; i < growths_.size(); ++i) growths_[i] = simulation_.span(i).growth;
}

void Auditor::end(const Advance& part) {
  simulation_.read(next_);
  const StateLayout& layout = simulation_.layout();
  for (const std::size_t i : controlled_) {
    add_control(simulation_.scene().joints()[i], layout.joint(state_.data(), i), layout.joint(next_.data(), i),
                part.duration);
  }
  for (std::size_t i = 0; i < growths_.size(); ++i) {
    add_damper(simulation_.scene().springs()[i], growths_[i], simulation_.span(i).growth, part.duration);
  }
  // Velocities are a part behind the positions; where motion is lost, its loads do no work.
  const double power = energy_.power(next_);
  audit_.integration -= 0.5 * part.duration * (power - energy_.power(state_));
  audit_.overlap += power * part.lost;
}

Audit Auditor::audit() const {
  Audit audit = audit_;
  const ImpulseWork& work = simulation_.impulse_work();
  audit.friction = work.friction;
  audit.contacts = work.contacts;
  audit.joints = work.joints;
  audit.overlap += work.overlap;
  return audit;
}

// The torque of the control is that at the end of the step. What its compliance gives and takes should be what its
// energy loses and gains; the rest, as far as the torque limit leaves room for it, is damping and drive.
void Auditor::add_control(const Joint& joint, const JointState& before, const JointState& after, double duration) {
  const auto limited = [&](double torque) { return std::clamp(torque, -joint.torque_limit, joint.torque_limit); };
  const double spring = joint.stiffness * (joint.target - after.position);
  const double damping = -joint.damping * after.velocity;
  const double drive = joint.damping * joint.target_velocity;
  const double turned = 0.5 * (before.velocity + after.velocity) * duration;
  audit_.integration +=
      limited(spring) * turned + compliance_energy(joint, after.position) - compliance_energy(joint, before.position);
  const double room = limited(spring + damping + drive) - limited(spring);
  if (room == 0.0) return;
  const double share = room / (damping + drive);
  audit_.damping += share * damping * turned;
  audit_.drives += share * drive * turned;
}

void Auditor::add_damper(const Spring& spring, double growth_before, double growth_after, double duration) {
  const double grown = 0.5 * (growth_before + growth_after) * duration;
  audit_.damping -= spring.damping * growth_before * grown;
}

}  // namespace energymargin

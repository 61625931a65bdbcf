#pragma once
// The balance of energy of a rollout, substep by substep.

#include <algorithm>
#include <vector>

#include "physics/engine.hpp"
#include "scene/energy.hpp"

namespace energymargin {

//! Watches an engine from where it is when this is made, to the end of its own life. The engine tells the work of
//! its impulses.
class Auditor {
 public:
  Auditor(Engine& engine, const Energy& energy)
      : engine_(engine), energy_(energy), length_rates_(engine.scene().springs().size()) {
    const std::vector<Joint>& joints = engine.scene().joints();
    for (std::size_t i = 0; i < joints.size() + engine.scene().tendons().size(); ++i) {
      const bool moves = i >= joints.size() || (joints[i].moves() && !joints[i].held);
      if (moves && engine.scene().control(i).drives()) controlled_.push_back(i);
    }
    *engine_.impulses() = {&before_, {}};
    engine_.read(next_);
  }
  ~Auditor() { *engine_.impulses() = {}; }
  Auditor(const Auditor&) = delete;
  Auditor& operator=(const Auditor&) = delete;

  //! To be called before anything acts in a substep, and when that is over.
  void begin() {
    engine_.read(before_);
    const Scene& scene = engine_.scene();
    held_.clear();
    for (const Load& load : engine_.spring_loads()) {
      if (scene.bodies()[load.body].kinematic && !scene.jointed(load.body)) held_.push_back(load);
    }
    if (!engine_.actuations().empty() || !held_.empty()) engine_.read(velocities_);
    state_ = next_;
    for (std::size_t i = 0; i < length_rates_.size(); ++i) length_rates_[i] = engine_.springs().span(i).length_rate;
  }
  void end(const SubstepResult& substep) {
    engine_.read(next_);
    add_actuations(substep.duration);
    const StateLayout& layout = engine_.layout();
    for (const std::size_t i : controlled_) {
      add_control(i, layout.controlled(state_.data(), i), layout.controlled(next_.data(), i), substep.duration);
    }
    for (std::size_t i = 0; i < length_rates_.size(); ++i) {
      const double stretch = 0.5 * (length_rates_[i] + engine_.springs().span(i).length_rate) * substep.duration;
      audit_.damping -= engine_.scene().springs()[i].damping * length_rates_[i] * stretch;
    }
    // Velocities are a substep behind the positions; where motion is lost, its loads do no work.
    const double power = energy_.power(next_);
    audit_.integration -= 0.5 * substep.duration * (power - energy_.power(state_));
    audit_.overlap += power * substep.lost;
  }

  //! The balance of the substeps so far; without energy_change and wrench, which others know.
  Audit audit() const {
    Audit audit = audit_;
    const Audit& work = engine_.impulses()->work;
    audit.friction = work.friction;
    audit.contacts = work.contacts;
    audit.joints = work.joints;
    audit.damping += work.damping;
    audit.plan += work.plan;
    audit.overlap += work.overlap;
    audit.integration += work.integration;
    return audit;
  }

 private:
  // A kinematic body is held against its springs; one that carries links the solver holds.
  void add_actuations(double duration) {
    if (engine_.actuations().empty() && held_.empty()) return;
    engine_.read(next_velocities_);
    const auto power = [this](const Load& load) {
      return load.power(velocities_[load.body], next_velocities_[load.body]);
    };
    for (const Load& load : engine_.actuations()) audit_.plan += power(load) * duration;
    for (const Load& load : held_) audit_.plan -= power(load) * duration;
  }
  // What the compliance gives, by its torque at the end of the step, should be what its energy loses, about the scene's
  // target; the rest is work of the robot. What the torque limit leaves room for is damping and drive.
  void add_control(std::size_t index, const JointState& before, const JointState& after, double duration) {
    const PositionControl& control = engine_.scene().control(index);
    const auto limited = [&](double torque) { return std::clamp(torque, -control.torque_limit, control.torque_limit); };
    const double spring = control.stiffness * (engine_.target(index) - after.position);
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

  Engine& engine_;
  const Energy& energy_;

  Motion before_;
  std::vector<Velocity> velocities_, next_velocities_;  // of all bodies, where the robot pushes some
  std::vector<Load> held_;                              // of springs on kinematic bodies that carry no links
  State state_;                                         // before the substep
  State next_;                                          // after it
  std::vector<double> length_rates_;                    // of the springs, before the substep
  std::vector<std::size_t> controlled_;                 // joints and tendons with a stiffness or a damping
  Audit audit_;
};

}  // namespace energymargin

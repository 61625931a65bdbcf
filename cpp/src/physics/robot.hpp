#pragma once
// What a robot does in each step: as its plan says, and as its feedback corrects it.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "base/random_draws.hpp"
#include "energymargin/plan.hpp"
#include "physics/engine.hpp"
#include "scene/feedback.hpp"

namespace energymargin {

//! The corrections of a Feedback, or what a Policy commands in their place. Their memory goes with the state of a
//! rollout, behind the scene's numbers: whether there was a control time, what acts, what is to act later, and the
//! forces of the last step or the policy's own memory.
class Corrections {
 public:
  Corrections(const Scene& scene, const Feedback& feedback, std::shared_ptr<const Policy> policy)
      : feedback_(feedback),
        policy_(std::move(policy)),
        step_(scene.stepping().step),
        observer_(scene, policy_ ? feedback.observed : std::vector<std::string>{}),
        first_(policy_ ? first_commands(scene, feedback) : Eigen::VectorXd::Zero(size())) {
    for (const std::string& name : policy_ ? std::vector<std::string>{} : feedback.observed) {
      observed_.push_back(observed(scene, name));
      if (observed_.back().kind == Observed::Kind::force)
        pairs_.emplace_back(observed_.back().index, observed_.back().other);
    }
    forces_.setZero(static_cast<Eigen::Index>(pairs_.size()));
    memory_.setZero(memory_size(feedback, policy_.get()));
  }

  Eigen::Index memory() const { return memory_.size(); }

  //! A state without memory begins as the law does, or with a control time.
  void restore(const State& state, Eigen::Index dimension) {
    has_moved_ = false;
    if (state.size() != dimension)
      memory_ = state.tail(memory_.size());
    else if (feedback_.memory.size() > 0)
      memory_ = feedback_.memory;
    else
      memory_.setZero();
  }
  const Eigen::VectorXd& remembered() {
    if (has_moved_) memory_.tail(forces_.size()) = forces_;
    return memory_;
  }

  //! Takes what presses in a substep, which may be the first one of its step: forces are means over a step.
  void feel(const Engine& engine, bool first) {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      double& force = forces_[static_cast<Eigen::Index>(i)];
      force = (first ? 0.0 : force) + engine.normal_impulse(pairs_[i].first, pairs_[i].second) / step_;
    }
  }

  //! Steps after one until there is a control time again.
  int steps_until_asked(int step) const {
    int steps = 1;
    while (control_time(step + steps) == control_time(step + steps - 1)) ++steps;
    return steps;
  }

  //! Those of a step; null if the limit was reached. `simulated`: as of Robot::decide.
  const double* at(const Engine& engine, int step, const NoiseSeeds* noise, const Limit& limit,
                   const State* simulated) {
    const double now = control_time(step);
    const bool begins = memory_[0] == 0.0;
    if (begins) memory_.segment(1, size() * (feedback_.delay + 1)) = first_.replicate(feedback_.delay + 1, 1);
    if (begins || control_time(step - 1) != now) {
      const std::optional<std::uint64_t> seed = seed_of(noise, step);
      if (!observe(engine, std::max(0.0, now), seed, limit, simulated)) return nullptr;
    }
    memory_[0] = 1.0;
    has_moved_ = true;
    return memory_.data() + 1;
  }

 private:
  static constexpr double rounding = 1e-6;  // of a step

  Eigen::Index size() const { return static_cast<Eigen::Index>(feedback_.corrected.size()); }

  // Number of the last control time up to a step.
  double control_time(int step) const {
    return std::ceil(((step + 0.5 - rounding) * step_ + feedback_.start) / feedback_.period) - 1.0;
  }

  static std::optional<std::uint64_t> seed_of(const NoiseSeeds* noise, int step) {
    std::optional<std::uint64_t> seed;
    for (std::size_t i = 0; noise && i < noise->size() && (*noise)[i].first <= step; ++i) seed = (*noise)[i].second;
    return seed;
  }

  bool observe(const Engine& engine, double time, std::optional<std::uint64_t> seed, const Limit& limit,
               const State* simulated) {
    if (simulated)
      state_ = *simulated;
    else
      engine.read(state_);
    const Eigen::Index queued = size() * feedback_.delay;
    Eigen::VectorXd newest(size());
    if (policy_ && !ask(time, seed, limit, newest)) return false;
    if (!policy_) newest = correct(time, seed);
    auto queue = memory_.segment(1, queued + size());  // the oldest first
    if (queued > 0) queue.head(queued) = queue.tail(queued).eval();
    queue.tail(size()) = newest;
    return true;
  }

  Eigen::VectorXd correct(double time, std::optional<std::uint64_t> seed) {
    const auto row = [time](std::size_t count) { return static_cast<Eigen::Index>(std::min(time, count - 1.0)); };
    const auto at = row(static_cast<std::size_t>(feedback_.references.rows()));
    Eigen::VectorXd error = feedback_.references.row(at).transpose() - numbers();
    if (seed && feedback_.noise.size() > 0) {
      Random random(*seed, static_cast<std::size_t>(time));
      for (Eigen::Index i = 0; i < error.size(); ++i) error[i] -= feedback_.noise[i] * random.normal();
    }
    return feedback_.gains[static_cast<std::size_t>(row(feedback_.gains.size()))] * error;
  }

  // One rollout alone, whose row fills the block.
  bool ask(double time, std::optional<std::uint64_t> seed, const Limit& limit, Eigen::VectorXd& newest) {
    const States observations = observer_(state_).replicate(Policy::block, 1);
    States memory = memory_.tail(policy_->memory).transpose().replicate(Policy::block, 1);
    States actions = States::Zero(Policy::block, size());
    const std::vector<std::uint64_t> seeds(seed ? Policy::block : 0, seed.value_or(0));
    const PolicyQuestion question{time * feedback_.period, static_cast<int>(time), observations, seeds, limit};
    if (!policy_->act(question, memory, actions)) return false;
    memory_.tail(policy_->memory) = memory.row(0).transpose();
    newest = actions.row(0).transpose();
    return true;
  }

  Eigen::VectorXd numbers() {
    Eigen::VectorXd values(static_cast<Eigen::Index>(observed_.size()));
    const Eigen::VectorXd forces = has_moved_ ? forces_ : Eigen::VectorXd(memory_.tail(forces_.size()));
    Eigen::Index force = 0;
    for (std::size_t i = 0; i < observed_.size(); ++i) {
      const bool presses = observed_[i].kind == Observed::Kind::force;
      values[static_cast<Eigen::Index>(i)] = presses ? forces[force++] : observer_(state_, observed_[i]);
    }
    return values;
  }

  const Feedback feedback_;
  const std::shared_ptr<const Policy> policy_;
  double step_;
  Observer observer_;
  Eigen::VectorXd first_;  // what acts before there was an answer
  std::vector<Observed> observed_;
  std::vector<std::pair<std::size_t, std::size_t>> pairs_;  // bodies whose forces are observed
  Eigen::VectorXd forces_;                                  // of the last step [N]
  Eigen::VectorXd memory_;
  State state_;             // scratch
  bool has_moved_ = false;  // since `restore`: then forces are known
};

//! Does in each step what a plan says, which fits the scene.
class Robot {
 public:
  Robot(const Scene& scene, const Plan& plan) : plan_(fine_rows(plan, scene.stepping().step)) {
    for (const Drive& drive : plan.wrenches) wrench_bodies_.push_back(scene.index(drive.body));
    for (const Targets& targets : plan.targets) joints_.push_back(scene.control_index(targets.joint));
    for (Servo& servo : plan_.velocities) {
      servo = with_default_limits(scene, servo);
      servo_bodies_.push_back(scene.index(servo.body));
    }
    for (const Targets& targets : plan_.targets) target_names_.push_back(targets.joint);
    if (!plan.feedback) return;
    corrections_.emplace(scene, *plan.feedback, plan.policy);
    for (const std::string& name : plan.feedback->corrected) corrected_.push_back(place_of(corrected(name)));
  }

  //! Numbers that a state has behind the scene's.
  Eigen::Index memory() const { return corrections_ ? corrections_->memory() : 0; }

  void restore(const State& state, Eigen::Index dimension) {
    if (corrections_) corrections_->restore(state, dimension);
  }

  //! Those numbers now.
  Eigen::VectorXd remembered() { return corrections_ ? corrections_->remembered() : Eigen::VectorXd(); }

  //! Observes a substep of a step.
  void feel(const Engine& engine, bool first) {
    if (corrections_) corrections_->feel(engine, first);
  }

  //! What a policy commands until the next call, or null: it is asked at its control times; and the seeds of the noise
  //! of what it observes.
  void take(const Eigen::VectorXd* commands, const NoiseSeeds* noise) {
    commands_ = commands;
    noise_ = noise;
  }

  //! Finds what acts in a step of the plan. False if the limit was reached before a policy answered. `simulated`: the
  //! state of a simulator, with its memory, in place of the engine's.
  bool decide(const Engine& engine, int step, const Limit& limit, const State* simulated = nullptr) {
    take_row(std::min(step, plan_.rows() - 1));
    return !plan_.feedback || correct(engine, step, limit, simulated);
  }

  //! That of the joints, in the order of their names.
  const std::vector<double>& targets() const { return targets_; }
  const std::vector<std::string>& target_names() const { return target_names_; }

  //! Steps after one until it observes the engine again.
  int steps_until_asked(int step) const {
    return corrections_ && !commands_ ? corrections_->steps_until_asked(step) : std::numeric_limits<int>::max();
  }

  //! Decides, and loads the engine with it. Behind the plan's end nothing acts but the last targets, or with a feedback
  //! the last row.
  bool act(Engine& engine, int step, const Limit& limit) {
    if (!decide(engine, step, limit)) return false;
    const int last = plan_.rows() - 1;
    for (std::size_t i = 0; i < joints_.size(); ++i) engine.set_target(joints_[i], targets_[i]);
    if (step > last && !plan_.feedback) return true;
    for (std::size_t i = 0; i < wrench_bodies_.size(); ++i) {
      const double* const wrench = wrenches_[i].data();
      engine.actuate({wrench_bodies_[i], vector(wrench), vector(wrench + 3)});
    }
    for (std::size_t i = 0; i < servo_bodies_.size(); ++i) {
      const Servo& servo = plan_.velocities[i];
      engine.add_motor(servo_bodies_[i], velocities_[i].head<3>(), velocities_[i].tail<3>(),
                       servo.force.value_or(unlimited), servo.torque.value_or(unlimited));
    }
    return true;
  }

 private:
  static constexpr double unlimited = std::numeric_limits<double>::infinity();  // force and torque, of a kinematic body

  struct Place {
    Corrected::Kind kind;
    std::size_t index;  // among those of its kind in the plan
    int axis;
  };

  Place place_of(const Corrected& number) const {
    const auto index = [&number](const auto& parts, auto name) {
      return static_cast<std::size_t>(
          std::find_if(parts.begin(), parts.end(), [&](const auto& part) { return part.*name == number.of; }) -
          parts.begin());
    };
    switch (number.kind) {
      case Corrected::Kind::target:
        return {number.kind, index(plan_.targets, &Targets::joint), 0};
      case Corrected::Kind::wrench:
        return {number.kind, index(plan_.wrenches, &Drive::body), number.axis};
      default:
        return {number.kind, index(plan_.velocities, &Servo::body), number.axis};
    }
  }

  void take_row(int row) {
    targets_.resize(joints_.size());
    wrenches_.resize(wrench_bodies_.size());
    velocities_.resize(servo_bodies_.size());
    for (std::size_t i = 0; i < joints_.size(); ++i) targets_[i] = plan_.targets[i].positions[row];
    for (std::size_t i = 0; i < wrenches_.size(); ++i) wrenches_[i] = plan_.wrenches[i].wrenches.row(row);
    for (std::size_t i = 0; i < velocities_.size(); ++i) velocities_[i] = plan_.velocities[i].velocities.row(row);
  }

  bool correct(const Engine& engine, int step, const Limit& limit, const State* simulated) {
    const double* const corrections =
        commands_ ? commands_->data() : corrections_->at(engine, step, noise_, limit, simulated);
    if (!corrections) return false;
    const Feedback& feedback = *plan_.feedback;
    for (std::size_t i = 0; i < corrected_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const Place& place = corrected_[i];
      double& number = place.kind == Corrected::Kind::target   ? targets_[place.index]
                       : place.kind == Corrected::Kind::wrench ? wrenches_[place.index][place.axis]
                                                               : velocities_[place.index][place.axis];
      number += corrections[i];
      if (feedback.low.size() > 0) number = std::clamp(number, feedback.low[at], feedback.high[at]);
    }
    return true;
  }

  Plan plan_;
  std::vector<std::size_t> wrench_bodies_, servo_bodies_, joints_;
  std::vector<std::string> target_names_;
  std::optional<Corrections> corrections_;
  std::vector<Place> corrected_;
  const Eigen::VectorXd* commands_ = nullptr;
  const NoiseSeeds* noise_ = nullptr;
  std::vector<double> targets_;                                     // of a step
  std::vector<Eigen::Matrix<double, 6, 1>> wrenches_, velocities_;  // of a step
};

}  // namespace energymargin

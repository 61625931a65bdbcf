#pragma once
// The clock of a search: when it checks the capture set, which exit is an escape, and when all is over.

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! Steps after which the sets are checked, from 0 to the horizon.
inline std::vector<int> check_steps(const Timing& timing) {
  std::vector<int> steps;
  for (int step = 0; step < timing.horizon; step += timing.check) steps.push_back(step);
  steps.push_back(timing.horizon);
  return steps;
}

//! Their times [s].
inline Eigen::VectorXd times_of(const std::vector<int>& steps, double step) {
  Eigen::VectorXd times(static_cast<Eigen::Index>(steps.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) times[static_cast<Eigen::Index>(i)] = step * steps[i];
  return times;
}

//! Outside at a check time, and at all that follow until `dwell` steps are over or the horizon has come.
class Exit {
 public:
  explicit Exit(int dwell) : dwell_(dwell) {}

  //! `step` is the check time.
  void check(bool inside, int step) {
    if (left_) return;
    if (inside) {
      since_ = -1;
    } else if (since_ < 0) {
      since_ = step;
    }
    left_ = since_ >= 0 && step - since_ >= dwell_;
  }

  //! The horizon has come: who is outside has left.
  void end() { left_ = since_ >= 0; }

  bool left() const { return left_; }

  //! The first check time outside, if it was the last one too, or if the set is left; else -1 [steps].
  int since() const { return since_; }

 private:
  int dwell_;
  int since_ = -1;
  bool left_ = false;
};

//! One rollout up to the horizon. `ends(state, step)` is asked at each check time behind the start, and may end it.
template <typename Ends>
Rollout roll_out_to_horizon(World& world, const State& start, const std::vector<Push>& pushes, const Timing& timing,
                            const Limit& limit, const Ends& ends, const Plan* plan = nullptr,
                            const NoiseSeeds* noise = nullptr) {
  int step = 0;
  Watch watch;
  watch.check_every = timing.check;
  watch.plan = plan;
  watch.noise = noise;
  watch.ends_for_good = true;
  watch.ends = [&](const State& state) { return ends(state, step += timing.check); };
  Rollout rollout = world.rollout_unchecked(start, pushes, limit, watch);
  if (rollout.complete && rollout.steps == timing.horizon && step != timing.horizon)
    ends(rollout.state, timing.horizon);
  return rollout;
}

//! A rollout under the clock, up to the first instant outside if there is one.
struct Stretch {
  Rollout rollout;
  bool escaped = false;     //!< its end is an escape
  StepCounts after_exit{};  //!< of the steps after its end that tell whether an exit lasts
};

//! Rollouts of a problem with a horizon. Times are steps since the problem's state, of the world that is passed in.
//! Check times are every `check` steps and the horizon. An object that is outside then has escaped if, without a
//! wrench, it is outside at all check times until `dwell` steps are over or the horizon has come.
class Horizon {
 public:
  //! None without a clock. If `captured` is null, nothing escapes. So many steps of the world are one of the problem's.
  static std::optional<Horizon> of(const Problem& problem, const Region* captured, int substeps = 1) {
    std::optional<Timing> timing = timing_of(problem);
    if (!timing) return std::nullopt;
    for (int* steps : {&timing->horizon, &timing->check, &timing->dwell}) *steps *= substeps;
    return Horizon(problem, *timing, captured);
  }

  int end() const { return timing_.horizon; }

  //! No wrench, up to the horizon.
  const Push& rest() const { return rest_; }

  //! The rollout of an edge from a state at `time` < end: cut at the horizon, and at the first check time outside.
  Stretch extend(World& world, const State& from, int time, const Edge& edge, const Limit& limit,
                 const Watch& watch = {}) const {
    bool outside = false;
    const RolloutQuestion asked = ask(from, time, edge, watch, outside);
    Rollout rollout = world.rollout_unchecked(asked.state, asked.pushes, limit, asked.watch);
    return extended(world, asked, std::move(rollout), outside, limit);
  }

  //! What is rolled out for that; `outside`, which outlives the rollout, says whether it ended there.
  RolloutQuestion ask(const State& from, int time, const Edge& edge, Watch watch, bool& outside) const {
    watch.first = time;
    watch.check_every = timing_.check;
    if (captured_) watch.ends = [this, &outside](const State& state) { return outside = !(*captured_)(state); };
    return {edge_start_(from), {{edge.wrenches, std::min(edge.steps, end() - time)}}, std::move(watch)};
  }

  //! What came of it.
  Stretch extended(World& world, const RolloutQuestion& asked, Rollout rolled, bool outside, const Limit& limit) const {
    const Watch& watch = asked.watch;
    Stretch stretch{std::move(rolled)};
    Rollout& rollout = stretch.rollout;
    const int time = watch.first + rollout.steps;
    if (!rollout.complete || !(watch.cost + rollout.effort < watch.bound)) return stretch;
    if (watch.ends && time == end()) watch.ends(rollout.state);
    if (!outside) return stretch;
    const std::optional<bool> stays = stays_outside(world, rollout.state, time, limit, stretch.after_exit);
    rollout.complete = stays.has_value();
    stretch.escaped = stays.value_or(false);
    return stretch;
  }

  //! The undisturbed future of the start, up to the horizon or to the first instant of its escape.
  Stretch undisturbed(World& world, const State& start, const Limit& limit) const {
    Exit exit(timing_.dwell);
    State first_outside;
    const auto check = [&](const State& state, int step) {
      exit.check((*captured_)(state), step);
      if (exit.since() == step) first_outside = state;
      return exit.left();
    };
    Stretch stretch{roll_out_to_horizon(world, edge_start_(start), {rest_}, timing_, limit, check)};
    Rollout& rollout = stretch.rollout;
    if (rollout.complete && rollout.steps == end()) exit.end();
    if (!rollout.complete || !exit.left()) return stretch;
    rollout.state = first_outside;
    stretch.after_exit.steps = rollout.steps - exit.since();
    rollout.steps = exit.since();
    stretch.escaped = true;
    return stretch;
  }

 private:
  Horizon(const Problem& problem, const Timing& timing, const Region* captured)
      : timing_(timing), edge_start_(problem), rest_(no_push(problem, timing.horizon)) {
    if (captured) captured_.emplace(*captured, problem.scene);
  }

  // None if the limit was reached first. Adds to the counts.
  std::optional<bool> stays_outside(World& world, const State& state, int time, const Limit& limit,
                                    StepCounts& counts) const {
    const int checks = (time + timing_.dwell + timing_.check - 1) / timing_.check;  // until dwell is over
    const int steps = std::min(checks * timing_.check, end()) - time;
    if (steps <= 0) return true;
    Watch watch;
    watch.first = time;
    watch.check_every = timing_.check;
    watch.ends = *captured_;
    try {
      const Rollout rollout = world.rollout_unchecked(edge_start_(state), {{rest_.wrenches, steps}}, limit, watch);
      counts += rollout;
      return rollout.complete ? std::optional(!(*captured_)(rollout.state)) : std::nullopt;
    } catch (const Diverged&) {  // nobody knows where it is
      return false;
    }
  }

  Timing timing_;
  std::optional<Membership> captured_;
  EdgeStart edge_start_;
  Push rest_;
};

}  // namespace energymargin::search

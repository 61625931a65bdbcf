#pragma once
// The clock of a search: when it looks at the capture set, which exit is an escape, and when all is over.

#include <functional>
#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! One rollout up to the horizon. `ends(state, step)` is asked at each check time behind the start, and may end it.
template <typename Ends>
Rollout roll_out_to_horizon(World& world, const State& start, const std::vector<Push>& pushes, const Timing& timing,
                            const Limit& limit, const Ends& ends, const Plan* plan = nullptr) {
  int step = 0;
  Watch watch;
  watch.look_every = timing.check;
  watch.plan = plan;
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
  static std::optional<Horizon> of(const Problem& problem, const Region* captured, int substeps = 1);

  int end() const { return timing_.horizon; }

  //! No wrench, up to the horizon.
  const Push& rest() const { return rest_; }

  //! The rollout of an edge from a state at `time` < end: cut at the horizon, and at the first check time outside.
  Stretch extend(World& world, const State& from, int time, const Edge& edge, const Limit& limit,
                 Watch watch = {}) const;

  //! The undisturbed future of the start, without a break up to the horizon or to where its exit is an escape; it ends
  //! at the first instant of that.
  Stretch undisturbed(World& world, const State& start, const Limit& limit) const;

 private:
  Horizon(const Problem& problem, const Timing& timing, const Region* captured);

  std::optional<bool> stays_outside(World& world, const State& state, int time, const Limit& limit,
                                    StepCounts& counts) const;

  Timing timing_;
  std::optional<Membership> captured_;
  EdgeStart edge_start_;
  Push rest_;
};

//! Plays escapes again with a quarter of the step. A simulation may let an object out where its steps are too long;
//! then the finer one does not.
class Confirmation {
 public:
  //! It plays escapes from the problem's capture set.
  explicit Confirmation(const Problem& problem);

  //! Whether the edges lead out, with their wrenches or, if these fall short, with up to 1.2 times as strong ones; at
  //! their end the object may go on without a wrench for as long as a longest edge. None if the limit was reached
  //! first. With a clock they follow the plan, and end at the horizon. `nodes` are those to which the edges lead: what
  //! two paths have in common is played once.
  std::optional<bool> leads_out(const std::vector<int>& nodes, const std::vector<Edge>& edges, const Limit& limit);

 private:
  struct Checkpoint {  // where a replay was at a node
    int node;
    State state;
    int time;
  };

  std::optional<bool> play(const std::vector<int>& nodes, const std::vector<Edge>& edges, double strength,
                           const Limit& limit);
  Stretch play(const State& from, int time, const Edge& edge, const Limit& limit);

  int substeps_;  // of a step of the search
  World world_;
  std::optional<Horizon> horizon_;
  State start_;
  EdgeStart edge_start_;
  Membership captured_;
  Edge rest_;
  std::vector<Checkpoint> checkpoints_;  // on the last path, under the wrenches themselves
};

}  // namespace energymargin::search

#pragma once
// The clock of a search: when it looks at the capture set, which exit is an escape, and when all is over.

#include <functional>
#include <optional>

#include "energymargin/limit.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/edge.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! A rollout under the clock, up to the first instant outside if there is one.
struct Stretch {
  Rollout rollout;
  bool escaped = false;     //!< its end is an escape
  StepCounts after_exit{};  //!< of the steps after its end that tell whether an exit lasts
};

//! Rollouts of a problem with a horizon. Times are steps since the problem's state, of the world that is passed in. The
//! capture set is looked at every `check` steps and at the horizon. Outside at a look is an escape if, without a wrench
//! from there on, all looks are outside until `dwell` steps are over or the horizon has come.
class Horizon {
 public:
  //! None without a clock. `captured` may be null: then nothing is looked at. The world's steps are so many `parts` of
  //! the problem's.
  static std::optional<Horizon> of(const Problem& problem, const Region* captured, int parts = 1);

  int end() const { return timing_.horizon; }

  //! No wrench, up to the horizon.
  const Push& rest() const { return rest_; }

  //! The rollout of an edge from a state at `time` < end: cut at the horizon, and at the first look outside.
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

}  // namespace energymargin::search

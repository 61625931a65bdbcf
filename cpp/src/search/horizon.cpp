#include "search/horizon.hpp"

#include <algorithm>
#include <utility>

#include "problem/exit.hpp"

namespace energymargin::search {

std::optional<Horizon> Horizon::of(const Problem& problem, const Region* captured, int parts) {
  std::optional<Timing> timing = timing_of(problem);
  if (!timing) return std::nullopt;
  for (int* steps : {&timing->horizon, &timing->check, &timing->dwell}) *steps *= parts;
  return Horizon(problem, *timing, captured);
}

Horizon::Horizon(const Problem& problem, const Timing& timing, const Region* captured)
    : timing_(timing), edge_start_(problem), rest_(no_push(problem, timing.horizon)) {
  if (captured) captured_.emplace(*captured, problem.scene);
}

Stretch Horizon::extend(World& world, const State& from, int time, const Edge& edge, const Limit& limit,
                        Watch watch) const {
  bool outside = false;
  watch.first = time;
  watch.look_every = timing_.check;
  if (captured_) watch.ends = [&](const State& state) { return outside = !(*captured_)(state); };
  Stretch stretch{
      world.rollout_unchecked(edge_start_(from), {{edge.wrenches, std::min(edge.steps, end() - time)}}, limit, watch)};
  Rollout& rollout = stretch.rollout;
  time += rollout.steps;
  if (!rollout.complete || !(watch.cost + rollout.effort < watch.bound)) return stretch;
  if (watch.ends && time == end()) watch.ends(rollout.state);
  if (!outside) return stretch;
  const std::optional<bool> stays = stays_outside(world, rollout.state, time, limit, stretch.after_exit);
  rollout.complete = stays.has_value();
  stretch.escaped = stays.value_or(false);
  return stretch;
}

// None if the limit was reached first. Adds to the counts.
std::optional<bool> Horizon::stays_outside(World& world, const State& state, int time, const Limit& limit,
                                           StepCounts& counts) const {
  const int looks = (time + timing_.dwell + timing_.check - 1) / timing_.check;  // until dwell is over
  const int steps = std::min(looks * timing_.check, end()) - time;
  if (steps <= 0) return true;
  Watch watch;
  watch.first = time;
  watch.look_every = timing_.check;
  watch.ends = *captured_;
  try {
    const Rollout rollout = world.rollout_unchecked(edge_start_(state), {{rest_.wrenches, steps}}, limit, watch);
    counts += rollout;
    return rollout.complete ? std::optional(!(*captured_)(rollout.state)) : std::nullopt;
  } catch (const Diverged&) {  // nobody knows where it is
    return false;
  }
}

Stretch Horizon::undisturbed(World& world, const State& start, const Limit& limit) const {
  Exit exit(timing_.dwell);
  State first_outside;
  int time = 0;
  const auto look = [&](const State& state) {
    exit.look((*captured_)(state), time);
    if (exit.since() == time) first_outside = state;
    return exit.left();
  };
  Watch watch;
  watch.look_every = timing_.check;
  if (captured_) {
    watch.ends = [&](const State& state) {
      time += timing_.check;
      return look(state);
    };
  }
  Stretch stretch{world.rollout_unchecked(edge_start_(start), {rest_}, limit, watch)};
  Rollout& rollout = stretch.rollout;
  if (!captured_ || !rollout.complete) return stretch;
  if (rollout.steps == end()) {
    time = end();
    look(rollout.state);
    exit.end();
  }
  if (!exit.left()) return stretch;
  rollout.state = first_outside;
  stretch.after_exit.steps = rollout.steps - exit.since();
  rollout.steps = exit.since();
  stretch.escaped = true;
  return stretch;
}

}  // namespace energymargin::search

#include "search/horizon.hpp"

#include <algorithm>
#include <utility>

#include "problem/exit.hpp"

namespace energymargin::search {
namespace {

constexpr int most_substeps = 4;
constexpr double strengths[] = {1.0, 1.1, 1.2};  // of the wrenches, until one leads out

// Fewer where a rollout would be longer than one may be.
int substeps_of(const Problem& problem) {
  const auto timing = timing_of(problem);
  if (!timing) return most_substeps;
  const int plan = problem.plan ? static_cast<int>(problem.plan->duration() / problem.scene.stepping().step) : 0;
  return std::clamp(most_steps / (std::max(timing->horizon, plan) + 1), 1, most_substeps);
}

}  // namespace

std::optional<Horizon> Horizon::of(const Problem& problem, const Region* captured, int substeps) {
  std::optional<Timing> timing = timing_of(problem);
  if (!timing) return std::nullopt;
  for (int* steps : {&timing->horizon, &timing->check, &timing->dwell}) *steps *= substeps;
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
  const int checks = (time + timing_.dwell + timing_.check - 1) / timing_.check;  // until dwell is over
  const int steps = std::min(checks * timing_.check, end()) - time;
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
  const auto check = [&](const State& state, int step) {
    exit.look((*captured_)(state), step);
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

Confirmation::Confirmation(const Problem& problem)
    : substeps_(substeps_of(problem)),
      world_(world_of(problem, substeps_)),
      horizon_(Horizon::of(problem, &problem.captured, substeps_)),
      start_(problem.state),
      edge_start_(problem),
      captured_(problem.captured, problem.scene),
      rest_(largest_edge(problem)) {
  rest_.wrenches.setZero();
  if (horizon_) rest_.steps = horizon_->end();
}

std::optional<bool> Confirmation::leads_out(const std::vector<int>& nodes, const std::vector<Edge>& edges,
                                            const Limit& limit) {
  if (edges.empty()) return true;  // the start is out
  for (const double strength : strengths) {
    try {
      const std::optional<bool> out = play(nodes, edges, strength, limit);
      if (!out || *out) return out;
    } catch (const Diverged&) {  // it leads nowhere
    }
  }
  return false;
}

std::optional<bool> Confirmation::play(const std::vector<int>& nodes, const std::vector<Edge>& edges, double strength,
                                       const Limit& limit) {
  std::size_t next = 0;
  if (strength == 1.0) {
    while (next < checkpoints_.size() && next < nodes.size() && checkpoints_[next].node == nodes[next]) ++next;
    checkpoints_.resize(next);
  }
  State state = next > 0 ? checkpoints_[next - 1].state : start_;
  int time = next > 0 ? checkpoints_[next - 1].time : 0;
  const auto over = [&] { return horizon_ && time >= horizon_->end(); };
  for (; next <= edges.size() && !over(); ++next) {
    Edge edge = next < edges.size() ? edges[next] : rest_;
    edge.wrenches *= strength;
    edge.steps *= substeps_;
    while (edge.steps > 0 && !over()) {  // an exit that does not last ends no edge
      const Stretch stretch = play(state, time, edge, limit);
      if (!stretch.rollout.complete) return std::nullopt;
      if (stretch.escaped) return true;
      state = stretch.rollout.state;
      time += stretch.rollout.steps;
      edge.steps -= stretch.rollout.steps;
    }
    if (strength == 1.0 && next < edges.size()) checkpoints_.push_back({nodes[next], state, time});
  }
  return false;
}

// It ends where it is out at a check time: a step of the search, or one of the clock.
Stretch Confirmation::play(const State& from, int time, const Edge& edge, const Limit& limit) {
  if (horizon_) return horizon_->extend(world_, from, time, edge, limit);
  Watch watch;
  watch.ends = [this](const State& state) { return !captured_(state); };
  watch.look_every = substeps_;
  Stretch stretch{world_.rollout_unchecked(edge_start_(from), {edge}, limit, watch)};
  stretch.escaped = stretch.rollout.complete && !captured_(stretch.rollout.state);
  return stretch;
}

}  // namespace energymargin::search

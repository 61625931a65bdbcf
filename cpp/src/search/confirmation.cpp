#include "search/confirmation.hpp"

#include <algorithm>
#include <utility>

namespace energymargin::search {
namespace {

constexpr int parts_of_a_step = 4;
constexpr double strengths[] = {1.0, 1.1, 1.2};  // of the wrenches, until one leads out

// Fewer where a rollout would be longer than one may be.
int parts_of(const Problem& problem) {
  const auto timing = timing_of(problem);
  if (!timing) return parts_of_a_step;
  const int plan = problem.plan ? static_cast<int>(problem.plan->duration() / problem.scene.stepping().step) : 0;
  return std::clamp(most_steps / (std::max(timing->horizon, plan) + 1), 1, parts_of_a_step);
}

}  // namespace

Confirmation::Confirmation(const Problem& problem, const Region& captured)
    : parts_(parts_of(problem)),
      world_(world_of(problem, parts_)),
      horizon_(Horizon::of(problem, &captured, parts_)),
      start_(problem.state),
      edge_start_(problem),
      captured_(captured, problem.scene),
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
  for (; next <= edges.size() && !(horizon_ && time >= horizon_->end()); ++next) {
    const Stretch stretch = play(state, time, next < edges.size() ? edges[next] : rest_, strength, limit);
    if (!stretch.rollout.complete) return std::nullopt;
    if (stretch.escaped) return true;
    state = stretch.rollout.state;
    time += stretch.rollout.steps;
    if (strength == 1.0 && next < edges.size()) checkpoints_.push_back({nodes[next], state, time});
  }
  return false;
}

// It ends where it is out, looked at as often as the search has steps, or as the clock says.
Stretch Confirmation::play(const State& from, int time, Edge edge, double strength, const Limit& limit) {
  edge.wrenches *= strength;
  if (horizon_) return play_with_clock(from, time, edge, limit);
  Watch watch;
  watch.ends = [this](const State& state) { return !captured_(state); };
  watch.look_every = parts_;
  edge.steps *= parts_;
  Stretch stretch{world_.rollout_unchecked(edge_start_(from), {edge}, limit, watch)};
  stretch.escaped = stretch.rollout.complete && !captured_(stretch.rollout.state);
  return stretch;
}

// An exit that is no escape, since it does not last, does not end the edge.
Stretch Confirmation::play_with_clock(const State& from, int time, Edge edge, const Limit& limit) {
  edge.steps = std::min(parts_ * edge.steps, horizon_->end() - time);
  Stretch whole = horizon_->extend(world_, from, time, edge, limit);
  while (whole.rollout.complete && !whole.escaped && whole.rollout.steps < edge.steps) {
    const int over = whole.rollout.steps;
    whole = horizon_->extend(world_, whole.rollout.state, time + over, {edge.wrenches, edge.steps - over}, limit);
    whole.rollout.steps += over;
  }
  return whole;
}

}  // namespace energymargin::search

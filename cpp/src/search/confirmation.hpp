#pragma once
// Escapes again, in a quarter of the step.

#include <algorithm>
#include <optional>
#include <vector>

#include "search/horizon.hpp"

namespace energymargin::search {

//! Plays escapes again with a quarter of the step: where an object got out by too long steps, it does not then.
class Confirmation {
 public:
  //! It plays escapes from the problem's capture set.
  explicit Confirmation(const Problem& problem)
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

  //! Whether the edges lead out, with their wrenches or, if these fall short, with up to 1.2 times as strong ones, and
  //! then without a wrench for as long as a longest edge or, with a clock, up to the horizon. None if the limit was
  //! reached first. `nodes` are those to which the edges lead: what two paths have in common is played once.
  std::optional<bool> leads_out(const std::vector<int>& nodes, const std::vector<Edge>& edges, const Limit& limit) {
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

 private:
  static constexpr int most_substeps = 4;
  static constexpr double strengths[] = {1.0, 1.1, 1.2};  // of the wrenches, until one leads out

  // Fewer where a rollout would be longer than one may be.
  static int substeps_of(const Problem& problem) {
    if (problem.scene.stepping().simulator) return 1;  // which has one step
    const auto timing = timing_of(problem);
    if (!timing) return most_substeps;
    const int plan = problem.plan ? static_cast<int>(problem.plan->duration() / problem.scene.stepping().step) : 0;
    return std::clamp(most_steps / (std::max(timing->horizon, plan) + 1), 1, most_substeps);
  }

  struct Checkpoint {  // where a replay was at a node
    int node;
    State state;
    int time;
  };

  std::optional<bool> play(const std::vector<int>& nodes, const std::vector<Edge>& edges, double strength,
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
  Stretch play(const State& from, int time, const Edge& edge, const Limit& limit) {
    if (horizon_) return horizon_->extend(world_, from, time, edge, limit);
    Watch watch;
    watch.ends = [this](const State& state) { return !captured_(state); };
    watch.check_every = substeps_;
    Stretch stretch{world_.rollout_unchecked(edge_start_(from), {edge}, limit, watch)};
    stretch.escaped = stretch.rollout.complete && !captured_(stretch.rollout.state);
    return stretch;
  }

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

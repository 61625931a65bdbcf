#include "energymargin/search/confirmation.hpp"

#include <utility>

namespace energymargin::search {
namespace {

constexpr int parts_of_a_step = 4;
constexpr double strengths[] = {1.0, 1.1, 1.2};  // of the wrenches, until one leads out

Scene finer(const Scene& scene) {
  Stepping stepping = scene.stepping();
  stepping.step /= parts_of_a_step;
  return scene.with_stepping(stepping);
}

}  // namespace

Confirmation::Confirmation(const Problem& problem, const Region& captured)
    : world_(finer(problem.scene)),
      start_(problem.state),
      edge_start_(problem),
      captured_(captured, problem.scene),
      rest_(largest_edge(problem)) {
  rest_.wrenches.setZero();
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
    while (next < played_.size() && next < nodes.size() && played_[next].node == nodes[next]) ++next;
    played_.resize(next);
  }
  State state = next > 0 ? played_[next - 1].state : start_;
  for (; next <= edges.size(); ++next) {
    const Rollout rollout = play(state, next < edges.size() ? edges[next] : rest_, strength, limit);
    if (!rollout.complete) return std::nullopt;
    state = rollout.state;
    if (!captured_(state)) return true;
    if (strength == 1.0 && next < edges.size()) played_.push_back({nodes[next], state});
  }
  return false;
}

// It ends where it is out, looked at as often as the search has steps.
Rollout Confirmation::play(const State& from, const Edge& edge, double strength, const Limit& limit) {
  Watch watch;
  watch.ends = [this](const State& state) { return !captured_(state); };
  watch.look_every = parts_of_a_step;
  return world_.rollout_unchecked(edge_start_(from), disturbance(strength * edge.wrenches),
                                  parts_of_a_step * edge.steps, limit, watch);
}

}  // namespace energymargin::search

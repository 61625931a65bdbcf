#include "search/shortening.hpp"

#include <algorithm>
#include <utility>

namespace energymargin::search {
namespace {

// With a clock.
constexpr double whole_share = 0.5;   // of the changes begin at the root, and of the guesses last up to the horizon
constexpr double single_share = 0.5;  // of the guesses push one object alone

}  // namespace

Shortening::Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed)
    : problem_(problem),
      largest_(std::move(largest)),
      horizon_(problem.horizon()),
      rng_(static_cast<std::uint_fast32_t>(seed)),
      changes_(largest_, horizon_, rng_) {}

bool Shortening::guess() {
  const bool whole = rng_.uniform01() < whole_share;
  const int start = whole ? 0 : rng_.uniformInt(0, *horizon_ - 1);
  TimedEdge push = rest(start, whole ? *horizon_ : rng_.uniformInt(1, *horizon_ - start));
  const auto axes = static_cast<int>(push.wrenches.size());
  const int object = rng_.uniform01() < single_share ? rng_.uniformInt(0, axes / wrench_axes - 1) : -1;
  for (int axis = 0; axis < axes; ++axis) {
    if (object >= 0 && axis / wrench_axes != object) continue;
    push.wrenches[axis] = rng_.uniformInt(-1, 1) * largest_.wrenches[axis];
  }
  path_ = {0};
  TimedEdges edges;
  prepend(edges, push, largest_.steps);
  return replay(0, with_waits(edges, 0));
}

bool Shortening::attempt() {
  const std::size_t node = draw_node();
  const EdgeChanges::Change change = changes_.draw();
  const bool whole = horizon_ && (EdgeChanges::concerns_all(change) || rng_.uniform01() < whole_share);
  const std::size_t from = whole ? 0 : node;
  TimedEdges edges = edges_from(from);
  if (edges.empty()) return false;
  changes_.apply(change, edges);
  return replay(from, horizon_ ? with_waits(edges, problem_.time(path_[from])) : edges);
}

// Of the path, but its end: where the first edge that changes starts or, with a clock, the wait before it.
std::size_t Shortening::draw_node() {
  auto node = static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(path_.size()) - 2));
  while (horizon_ && node > 0 && problem_.edge(path_[node]).wrenches.isZero(0.0)) --node;
  return node;
}

// With a clock without waits: they are what lies between two edges.
TimedEdges Shortening::edges_from(std::size_t node) const {
  TimedEdges edges;
  for (std::size_t i = node + 1; i < path_.size(); ++i) {
    TimedEdge edge{problem_.edge(path_[i]), problem_.time(path_[i - 1])};
    if (!horizon_ || !edge.wrenches.isZero(0.0)) edges.push_back(std::move(edge));
  }
  return edges;
}

// Each at its time, as far as the one before it and the horizon leave it; `time` is where they begin.
TimedEdges Shortening::with_waits(const TimedEdges& edges, int time) const {
  TimedEdges schedule;
  for (TimedEdge edge : edges) {
    const int end = std::min(edge.start + edge.steps, *horizon_);
    edge.start = std::max(edge.start, time);
    edge.steps = end - edge.start;
    if (edge.steps < 1 || edge.wrenches.isZero(0.0)) continue;
    if (edge.start > time) schedule.push_back(rest(time, edge.start - time));
    schedule.push_back(edge);
    time = end;
  }
  if (time < *horizon_) schedule.push_back(rest(time, *horizon_ - time));
  return schedule;
}

TimedEdge Shortening::rest(int start, int steps) const {
  return {{Eigen::VectorXd::Zero(largest_.wrenches.size()), steps}, start};
}

// An escape that falls short ends without a wrench: what it lacks may come of itself, and costs nothing. With a clock
// the edges end with that rest.
bool Shortening::replay(std::size_t from, const TimedEdges& edges) {
  int node = path_[from];
  const std::size_t count = horizon_ ? edges.size() : edges.size() + 1;
  for (std::size_t i = 0; i < count && !problem_.spent(); ++i) {
    node = problem_.extend(node, i < edges.size() ? edges[i] : rest(0, largest_.steps));
    if (!problem_.allowed(node)) return false;
    if (!problem_.escaped(node)) continue;
    start(node);
    problem_.lower_bound(problem_.cost(node));
    return true;
  }
  return false;
}

}  // namespace energymargin::search

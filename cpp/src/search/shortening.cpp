#include "energymargin/search/shortening.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace energymargin::search {
namespace {

// Sizes of a nudge, as shares of the bounds, drawn evenly in their logarithm: an escape that is far from the best wants
// large ones, and one that is close small ones.
constexpr double smallest_nudge = 1e-3;
constexpr double largest_nudge = 0.5;
constexpr double axis_share = 0.5;  // of the nudges are along one axis
constexpr double end_share = 0.15;  // of the nudges set an axis to zero or to a bound
constexpr double rest_share = 0.5;  // of the edges that are cut go on without a wrench

}  // namespace

const std::vector<Shortening::Change> Shortening::changes{
    &Shortening::drop,  &Shortening::halt,      &Shortening::weaken, &Shortening::coast,
    &Shortening::nudge, &Shortening::nudge_all, &Shortening::cut,    &Shortening::merge,
};

Shortening::Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed)
    : problem_(problem), largest_(std::move(largest)), rng_(static_cast<std::uint_fast32_t>(seed)) {}

bool Shortening::attempt() {
  const auto from = static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(path_.size()) - 2));
  const auto change = changes[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(changes.size()) - 1))];
  Edges edges;
  for (std::size_t i = from + 1; i < path_.size(); ++i) edges.push_back(problem_.edge(path_[i]));
  (this->*change)(edges);
  return replay(from, edges);
}

void Shortening::drop(Edges& edges) { edges.erase(edges.begin()); }

void Shortening::halt(Edges& edges) {
  edges.front().steps = std::max(1, static_cast<int>(edges.front().steps * rng_.uniform01()));
}

void Shortening::weaken(Edges& edges) { edges.front().wrenches *= rng_.uniform01(); }

void Shortening::coast(Edges& edges) { edges.front().wrenches.setZero(); }

void Shortening::nudge(Edges& edges) { edges.front() = nudged(edges.front()); }

void Shortening::nudge_all(Edges& edges) {
  for (Edge& edge : edges) edge = nudged(edge);
}

void Shortening::cut(Edges& edges) {
  const Edge whole = edges.front();
  if (whole.steps < 2) return;
  Edge first = whole;
  Edge second = whole;
  first.steps = rng_.uniformInt(1, whole.steps - 1);
  second.steps = whole.steps - first.steps;
  if (rng_.uniform01() < rest_share) {
    second.wrenches.setZero();
  } else {
    second = nudged(second);
  }
  edges.front() = nudged(first);
  edges.insert(edges.begin() + 1, second);
}

void Shortening::merge(Edges& edges) {
  if (edges.size() < 2) return;
  const Edge& one = edges[0];
  Edge& two = edges[1];
  const int steps = one.steps + two.steps;
  two.wrenches = (one.steps * one.wrenches + two.steps * two.wrenches) / steps;
  two.steps = std::min(steps, largest_.steps);
  edges.erase(edges.begin());
}

Edge Shortening::nudged(Edge edge) {
  const double size = std::exp(rng_.uniformReal(std::log(smallest_nudge), std::log(largest_nudge)));
  const auto axes = static_cast<int>(edge.wrenches.size());
  const int only = rng_.uniform01() < axis_share ? rng_.uniformInt(0, axes - 1) : axes;
  for (int axis = 0; axis < axes; ++axis) {
    const double bound = largest_.wrenches[axis];
    if (bound == 0.0 || (only < axes && axis != only)) continue;
    const double moved = edge.wrenches[axis] + size * bound * rng_.gaussian01();
    edge.wrenches[axis] = std::clamp(moved, -bound, bound);
  }
  if (rng_.uniform01() < end_share) {
    const int axis = rng_.uniformInt(0, axes - 1);
    edge.wrenches[axis] = rng_.uniformInt(-1, 1) * largest_.wrenches[axis];
  }
  const double longer = edge.steps * std::exp(size * rng_.gaussian01());
  edge.steps = std::clamp(static_cast<int>(std::lround(longer)) + rng_.uniformInt(-1, 1), 1, largest_.steps);
  return edge;
}

// An escape that falls short ends without a wrench: what it lacks may come of itself, and costs nothing.
bool Shortening::replay(std::size_t from, const Edges& edges) {
  int node = path_[from];
  const Edge rest{Eigen::VectorXd::Zero(largest_.wrenches.size()), largest_.steps};
  for (std::size_t i = 0; i <= edges.size() && !problem_.spent(); ++i) {
    node = problem_.extend(node, i < edges.size() ? edges[i] : rest);
    if (!problem_.allowed(node)) return false;
    if (!problem_.escaped(node)) continue;
    start(node);
    problem_.lower_bound(problem_.cost(node));
    return true;
  }
  return false;
}

}  // namespace energymargin::search

#include "search/shortening.hpp"

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

// With a clock.
constexpr double whole_share = 0.5;   // of the changes begin at the root, and of the guesses last up to the horizon
constexpr double single_share = 0.5;  // of the guesses push one object alone
constexpr double all_share = 0.5;     // of the shifts, and of the pushes that become one, take all edges
constexpr double small_share = 0.5;   // of the shifts are small
constexpr double tiny = 1e-300;       // instead of a bound of 0, where the wrench is 0 too
constexpr int axes_of_an_object = 6;

}  // namespace

Shortening::Shortening(BoundedProblem& problem, Edge largest, std::uint64_t seed)
    : problem_(problem),
      largest_(std::move(largest)),
      horizon_(problem.horizon()),
      changes_(changes()),
      rng_(static_cast<std::uint_fast32_t>(seed)) {}

std::vector<Shortening::Change> Shortening::changes() const {
  std::vector<Change> all{&Shortening::drop,  &Shortening::halt,      &Shortening::weaken, &Shortening::coast,
                          &Shortening::nudge, &Shortening::nudge_all, &Shortening::cut,    &Shortening::merge};
  if (!horizon_) return all;
  all.insert(all.end(), {&Shortening::shift, &Shortening::hasten});
  if (largest_.wrenches.size() > axes_of_an_object) all.push_back(&Shortening::silence);
  return all;
}

bool Shortening::guess() {
  const bool whole = rng_.uniform01() < whole_share;
  const int start = whole ? 0 : rng_.uniformInt(0, *horizon_ - 1);
  TimedEdge push = rest(start, whole ? *horizon_ : rng_.uniformInt(1, *horizon_ - start));
  const auto axes = static_cast<int>(push.wrenches.size());
  const int object = rng_.uniform01() < single_share ? rng_.uniformInt(0, axes / axes_of_an_object - 1) : -1;
  for (int axis = 0; axis < axes; ++axis) {
    if (object >= 0 && axis / axes_of_an_object != object) continue;
    push.wrenches[axis] = rng_.uniformInt(-1, 1) * largest_.wrenches[axis];
  }
  path_ = {0};
  Edges edges;
  insert_whole(edges, push);
  return replay(0, with_waits(edges, 0));
}

bool Shortening::attempt() {
  const std::size_t node = drawn_node();
  const auto change = changes_[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(changes_.size()) - 1))];
  const bool whole = horizon_ && (change == &Shortening::silence || rng_.uniform01() < whole_share);
  const std::size_t from = whole ? 0 : node;
  Edges edges = edges_from(from);
  if (edges.empty()) return false;
  (this->*change)(edges);
  return replay(from, horizon_ ? with_waits(edges, problem_.time(path_[from])) : edges);
}

// Of the path, but its end: where the first edge that changes starts or, with a clock, the wait before it.
std::size_t Shortening::drawn_node() {
  auto node = static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(path_.size()) - 2));
  while (horizon_ && node > 0 && problem_.edge(path_[node]).wrenches.isZero(0.0)) --node;
  return node;
}

// With a clock without waits: they are what lies between two edges.
Shortening::Edges Shortening::edges_from(std::size_t node) const {
  Edges edges;
  for (std::size_t i = node + 1; i < path_.size(); ++i) {
    TimedEdge edge{problem_.edge(path_[i]), problem_.time(path_[i - 1])};
    if (!horizon_ || !edge.wrenches.isZero(0.0)) edges.push_back(std::move(edge));
  }
  return edges;
}

// Each at its time, as far as the one before it and the horizon leave it; `time` is where they begin.
Shortening::Edges Shortening::with_waits(const Edges& edges, int time) const {
  Edges timed;
  for (TimedEdge edge : edges) {
    const int end = std::min(edge.start + edge.steps, *horizon_);
    edge.start = std::max(edge.start, time);
    edge.steps = end - edge.start;
    if (edge.steps < 1 || edge.wrenches.isZero(0.0)) continue;
    if (edge.start > time) timed.push_back(rest(time, edge.start - time));
    timed.push_back(edge);
    time = end;
  }
  if (time < *horizon_) timed.push_back(rest(time, *horizon_ - time));
  return timed;
}

Shortening::TimedEdge Shortening::rest(int start, int steps) const {
  return {{Eigen::VectorXd::Zero(largest_.wrenches.size()), steps}, start};
}

void Shortening::drop(Edges& edges) { edges.erase(edges.begin()); }

void Shortening::halt(Edges& edges) {
  edges.front().steps = std::max(1, static_cast<int>(edges.front().steps * rng_.uniform01()));
}

void Shortening::weaken(Edges& edges) { edges.front().wrenches *= rng_.uniform01(); }

void Shortening::coast(Edges& edges) { edges.front().wrenches.setZero(); }

void Shortening::nudge(Edges& edges) { edges.front() = nudged(edges.front()); }

void Shortening::nudge_all(Edges& edges) {
  for (TimedEdge& edge : edges) edge = nudged(edge);
}

void Shortening::cut(Edges& edges) {
  const TimedEdge whole = edges.front();
  if (whole.steps < 2) return;
  TimedEdge first = whole;
  TimedEdge second = whole;
  first.steps = rng_.uniformInt(1, whole.steps - 1);
  second.steps = whole.steps - first.steps;
  second.start += first.steps;
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
  const TimedEdge& one = edges[0];
  TimedEdge& two = edges[1];
  const int steps = one.steps + two.steps;
  two.wrenches = (one.steps * one.wrenches + two.steps * two.wrenches) / steps;
  two.steps = std::min(steps, largest_.steps);
  two.start = one.start;
  edges.erase(edges.begin());
}

// All edges, or those from one of them on, come later or earlier: as far as there is time, or by a little.
void Shortening::shift(Edges& edges) {
  const auto last = static_cast<int>(edges.size()) - 1;
  const int first = rng_.uniform01() < all_share ? 0 : rng_.uniformInt(0, last);
  const int most = std::max(*horizon_ - 1 - edges[static_cast<std::size_t>(first)].start, 0);
  const int least = -std::min(edges[static_cast<std::size_t>(first)].start, *horizon_);
  int steps = rng_.uniformInt(least, most);
  if (rng_.uniform01() < small_share) steps = static_cast<int>(steps * drawn_size());
  if (steps == 0) steps = 1 - 2 * rng_.uniformInt(0, 1);
  for (int i = first; i <= last; ++i) edges[static_cast<std::size_t>(i)].start += steps;
}

// The first few edges become one push with all their impulse, or a little less: as strong as the bounds let it be, and
// so as early as can be.
void Shortening::hasten(Edges& edges) {
  const auto all = static_cast<int>(edges.size());
  const int count = rng_.uniform01() < all_share ? all : rng_.uniformInt(1, all);
  TimedEdge push = rest(edges.front().start, 0);
  for (int i = 0; i < count; ++i)
    push.wrenches += edges[static_cast<std::size_t>(i)].steps * edges[static_cast<std::size_t>(i)].wrenches;
  const double steps = (push.wrenches.array().abs() / largest_.wrenches.array().max(tiny)).maxCoeff();
  edges.erase(edges.begin(), edges.begin() + count);
  if (steps == 0.0) return;
  push.wrenches /= steps;
  push.steps = std::max(1, static_cast<int>(std::ceil(steps * (1.0 - rng_.uniform01() * drawn_size()))));
  insert_whole(edges, push);
}

// In front of the others, as edges that are not too long.
void Shortening::insert_whole(Edges& edges, const TimedEdge& push) const {
  const int left = push.steps % largest_.steps;
  for (int over = push.steps - left; over >= 0; over -= largest_.steps) {
    TimedEdge part = push;
    part.start += over;
    part.steps = std::min(largest_.steps, push.steps - over);
    if (part.steps > 0) edges.insert(edges.begin(), part);
  }
}

// All objects but one are left alone.
void Shortening::silence(Edges& edges) {
  const auto objects = static_cast<int>(largest_.wrenches.size()) / axes_of_an_object;
  const int disturbed = rng_.uniformInt(0, objects - 1);
  for (TimedEdge& edge : edges) {
    for (int axis = 0; axis < edge.wrenches.size(); ++axis) {
      if (axis / axes_of_an_object != disturbed) edge.wrenches[axis] = 0.0;
    }
  }
}

double Shortening::drawn_size() {
  return std::exp(rng_.uniformReal(std::log(smallest_nudge), std::log(largest_nudge)));
}

Shortening::TimedEdge Shortening::nudged(TimedEdge edge) {
  const double size = drawn_size();
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

// An escape that falls short ends without a wrench: what it lacks may come of itself, and costs nothing. With a clock
// the edges end with that rest.
bool Shortening::replay(std::size_t from, const Edges& edges) {
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

#include "search/edge_changes.hpp"

#include <algorithm>
#include <cmath>

#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

// Sizes of a nudge, as shares of the bounds, drawn evenly in their logarithm: an escape that is far from the best wants
// large ones, and one that is close small ones.
constexpr double smallest_nudge = 1e-3;
constexpr double largest_nudge = 0.5;
constexpr double silent_share = 0.5;  // of the changes of an axis in all edges leave nothing along it
constexpr double weakest = 1e-3;      // of the factors by which all edges are weakened, drawn evenly in their logarithm
constexpr double axis_share = 0.5;    // of the nudges are along one axis
constexpr double end_share = 0.15;    // of the nudges set an axis to zero or to a bound
constexpr double rest_share = 0.5;    // of the edges that are cut go on without a wrench

// With a clock.
constexpr double all_share = 0.5;    // of the shifts, and of the pushes that become one, take all edges
constexpr double small_share = 0.5;  // of the shifts are small
constexpr double tiny = 1e-300;      // instead of a bound of 0, where the wrench is 0 too

// As strong as it was, or as the bounds let it be.
Eigen::VectorXd bounded(const Eigen::VectorXd& wrenches, const Eigen::VectorXd& bounds) {
  double scale = 1.0;
  for (Eigen::Index axis = 0; axis < wrenches.size(); ++axis) {
    if (std::abs(wrenches[axis]) > bounds[axis]) scale = std::min(scale, bounds[axis] / std::abs(wrenches[axis]));
  }
  return (scale * wrenches).cwiseMin(bounds).cwiseMax(-bounds);  // rounding
}

}  // namespace

void prepend(TimedEdges& edges, const TimedEdge& push, int longest) {
  const int left = push.steps % longest;
  for (int over = push.steps - left; over >= 0; over -= longest) {
    TimedEdge part = push;
    part.start += over;
    part.steps = std::min(longest, push.steps - over);
    if (part.steps > 0) edges.insert(edges.begin(), part);
  }
}

EdgeChanges::EdgeChanges(const Edge& largest, std::optional<int> horizon, ompl::RNG& rng)
    : largest_(largest), horizon_(horizon), rng_(rng) {
  for (int axis = 0; axis < largest_.wrenches.size(); ++axis) {
    if (largest_.wrenches[axis] > 0.0) axes_.push_back(axis);
  }
  if (axes_.empty()) axes_.push_back(0);  // any: all wrenches are 0
  const auto halt = [this](TimedEdge& edge) {
    edge.steps = std::max(1, static_cast<int>(edge.steps * rng_.uniform01()));
  };
  const auto nudge_all = [this](TimedEdges& edges) {
    for (TimedEdge& edge : edges) edge = nudge(edge);
  };
  changes_ = {{[](TimedEdges& edges) { edges.erase(edges.begin()); }},
              {[halt](TimedEdges& edges) { halt(edges.front()); }},
              {[this](TimedEdges& edges) { edges.front().wrenches *= rng_.uniform01(); }},
              {[](TimedEdges& edges) { edges.front().wrenches.setZero(); }},
              {[this](TimedEdges& edges) { edges.front() = nudge(edges.front()); }},
              {nudge_all},
              {[this](TimedEdges& edges) { cut(edges); }},
              {[this](TimedEdges& edges) { merge(edges); }}};
  if (horizon_) {
    changes_.push_back({[this](TimedEdges& edges) { shift(edges); }});
    changes_.push_back({[this](TimedEdges& edges) { hasten(edges); }});
  } else {
    changes_.push_back({[this](TimedEdges& edges) { weaken_all(edges); }});
  }
  if (largest_.wrenches.size() > wrench_axes) changes_.push_back({[this](TimedEdges& edges) { silence(edges); }, true});
}

const EdgeChanges::Change& EdgeChanges::draw() {
  return changes_[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(changes_.size()) - 1))];
}

// An object that is about to leave by itself needs next to nothing. Along one axis it may need nothing at all.
void EdgeChanges::weaken_all(TimedEdges& edges) {
  const double factor = std::exp(rng_.uniformReal(std::log(weakest), 0.0));
  if (rng_.uniform01() < axis_share) {
    const int axis = draw_axis();
    const bool silent = rng_.uniform01() < silent_share;
    for (TimedEdge& edge : edges) edge.wrenches[axis] *= silent ? 0.0 : factor;
  } else {
    for (TimedEdge& edge : edges) edge.wrenches *= factor;
  }
}

void EdgeChanges::cut(TimedEdges& edges) {
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
    second = nudge(second);
  }
  edges.front() = nudge(first);
  edges.insert(edges.begin() + 1, second);
}

void EdgeChanges::merge(TimedEdges& edges) {
  if (edges.size() < 2) return;
  const TimedEdge& first = edges[0];
  TimedEdge& second = edges[1];
  const int steps = first.steps + second.steps;
  second.wrenches = (first.steps * first.wrenches + second.steps * second.wrenches) / steps;
  second.steps = std::min(steps, largest_.steps);
  second.start = first.start;
  edges.erase(edges.begin());
}

// All edges, or those from one of them on, come later or earlier: as far as there is time, or by a little.
void EdgeChanges::shift(TimedEdges& edges) {
  const auto last = static_cast<int>(edges.size()) - 1;
  const int first = rng_.uniform01() < all_share ? 0 : rng_.uniformInt(0, last);
  const int most = std::max(*horizon_ - 1 - edges[static_cast<std::size_t>(first)].start, 0);
  const int least = -std::min(edges[static_cast<std::size_t>(first)].start, *horizon_);
  int steps = rng_.uniformInt(least, most);
  if (rng_.uniform01() < small_share) steps = static_cast<int>(steps * draw_size());
  if (steps == 0) steps = 1 - 2 * rng_.uniformInt(0, 1);
  for (int i = first; i <= last; ++i) edges[static_cast<std::size_t>(i)].start += steps;
}

// The first few edges become one push with all their impulse, or a little less: as strong as the bounds let it be, and
// so as early as can be.
void EdgeChanges::hasten(TimedEdges& edges) {
  const auto all = static_cast<int>(edges.size());
  const int count = rng_.uniform01() < all_share ? all : rng_.uniformInt(1, all);
  TimedEdge push{{Eigen::VectorXd::Zero(largest_.wrenches.size()), 0}, edges.front().start};
  for (int i = 0; i < count; ++i) {
    const TimedEdge& edge = edges[static_cast<std::size_t>(i)];
    push.wrenches += edge.steps * edge.wrenches;
  }
  const double steps = (push.wrenches.array().abs() / largest_.wrenches.array().max(tiny)).maxCoeff();
  edges.erase(edges.begin(), edges.begin() + count);
  if (steps == 0.0) return;
  push.wrenches /= steps;
  const double share = rng_.uniform01();  // first this: compilers order operands freely
  push.steps = std::max(1, static_cast<int>(std::ceil(steps * (1.0 - share * draw_size()))));
  prepend(edges, push, largest_.steps);
}

// All objects but one are left alone.
void EdgeChanges::silence(TimedEdges& edges) {
  const auto objects = static_cast<int>(largest_.wrenches.size()) / wrench_axes;
  const int disturbed = rng_.uniformInt(0, objects - 1);
  for (TimedEdge& edge : edges) {
    for (int axis = 0; axis < edge.wrenches.size(); ++axis) {
      if (axis / wrench_axes != disturbed) edge.wrenches[axis] = 0.0;
    }
  }
}

TimedEdge EdgeChanges::nudge(TimedEdge edge) {
  const double size = draw_size();
  nudge_wrenches(edge.wrenches, size);
  const double steps = edge.steps * std::exp(size * rng_.gaussian01());
  edge.steps = std::clamp(static_cast<int>(std::lround(steps)) + rng_.uniformInt(-1, 1), 1, largest_.steps);
  return edge;
}

void EdgeChanges::nudge_wrenches(Eigen::VectorXd& wrenches, double size) {
  const auto axes = static_cast<int>(wrenches.size());
  const int only = rng_.uniform01() < axis_share ? draw_axis() : axes;
  for (int axis = 0; axis < axes; ++axis) {
    const double bound = largest_.wrenches[axis];
    if (bound == 0.0 || (only < axes && axis != only)) continue;
    const double value = wrenches[axis] + size * bound * rng_.gaussian01();
    wrenches[axis] = std::clamp(value, -bound, bound);
  }
  if (rng_.uniform01() >= end_share) return;
  const int axis = draw_axis();
  wrenches[axis] = rng_.uniformInt(-1, 1) * largest_.wrenches[axis];
}

int EdgeChanges::draw_axis() {
  return axes_[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(axes_.size()) - 1))];
}

double EdgeChanges::draw_size() {
  return std::exp(rng_.uniformReal(std::log(smallest_nudge), std::log(largest_nudge)));
}

SlowMotion::SlowMotion(const Problem& problem, const Edge& largest)
    : energy_(problem.scene), largest_(largest), step_(problem.scene.stepping().step) {
  const StateLayout layout(problem.scene);
  for (const std::size_t object : problem.scene.with_role(Role::object)) objects_.push_back(layout.offset(object));
}

TimedEdges SlowMotion::operator()(const std::vector<Passage>& escape, const State& frame, double slowdown,
                                  double surplus) const {
  const double saved = 1.0 - 1.0 / (slowdown * slowdown);  // of the kinetic energy
  TimedEdges edges;
  Eigen::VectorXd push = Eigen::VectorXd::Zero(largest_.wrenches.size());
  for (const Passage& passage : escape) {
    TimedEdge edge{passage.edge};
    const bool first = push.isZero(0.0);
    if (!edge.wrenches.isZero(0.0)) push = edge.wrenches;
    if (push.isZero(0.0)) {  // it waits for its time to come
      edges.push_back(edge);
      continue;
    }
    const double gain = energy_.kinetic(passage.to, frame) - energy_.kinetic(passage.from, frame);
    const double needed = (work(edge.wrenches, passage, frame) - saved * gain) * (first ? 1.0 + surplus : 1.0);
    const double done = work(push, passage, frame);
    if (done > 0.0) edge.wrenches = bounded(std::max(needed / done, 0.0) * push, largest_.wrenches);
    edge.steps = std::max(1, static_cast<int>(std::lround(slowdown * edge.steps)));
    TimedEdges parts;
    prepend(parts, edge, largest_.steps);
    edges.insert(edges.end(), parts.begin(), parts.end());
  }
  return edges;
}

double SlowMotion::work(const Eigen::VectorXd& wrenches, const Passage& passage, const State& frame) const {
  const double time = passage.edge.steps * step_;
  double work = 0.0;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const BodyState from = StateLayout::read(passage.from.data() + objects_[i]);
    const BodyState to = StateLayout::read(passage.to.data() + objects_[i]);
    const BodyState moving = StateLayout::read(frame.data() + objects_[i]);
    const auto wrench = wrenches.segment<wrench_axes>(static_cast<Eigen::Index>(i) * wrench_axes);
    work += wrench.head<3>().dot(to.position - from.position - time * moving.velocity);
    work += wrench.tail<3>().dot(rotation(from, to) - time * moving.angular_velocity);
  }
  return work;
}

}  // namespace energymargin::search

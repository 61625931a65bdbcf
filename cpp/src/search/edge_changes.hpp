#pragma once
// Changes to the edges of an escape: small random ones, and the same way at a lower speed.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "base/portable.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "scene/energy.hpp"
#include "search/cost_space.hpp"
#include "search/ompl_random.hpp"

namespace energymargin::search {

//! An edge and when it starts.
struct TimedEdge : Edge {
  int start = 0;  //!< steps since the root; without a clock edges follow one another, and it means nothing
};
using TimedEdges = std::vector<TimedEdge>;

//! Puts a push in front of other edges, as edges of at most `longest` steps.
inline void prepend(TimedEdges& edges, const TimedEdge& push, int longest) {
  const int left = push.steps % longest;
  for (int over = push.steps - left; over >= 0; over -= longest) {
    TimedEdge part = push;
    part.start += over;
    part.steps = std::min(longest, push.steps - over);
    if (part.steps > 0) edges.insert(edges.begin(), part);
  }
}

class EdgeChanges {
 public:
  //! `largest` bounds the edges; `horizon` is in steps, none without a clock. `largest` and `rng` outlive this.
  EdgeChanges(const Edge& largest, std::optional<int> horizon, Draws& rng)
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
    if (largest_.wrenches.size() > wrench_axes)
      changes_.push_back({[this](TimedEdges& edges) { silence(edges); }, true});
  }

  EdgeChanges(const EdgeChanges&) = delete;
  EdgeChanges& operator=(const EdgeChanges&) = delete;

  //! A change of the first of some edges, or of several of them. There is at least one; afterwards there may be none.
  struct Change {
    std::function<void(TimedEdges&)> apply;
    bool concerns_all = false;  //!< it is one of all edges of an escape
  };

  //! Any change, all equally likely.
  const Change& draw() {
    return changes_[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(changes_.size()) - 1))];
  }

 private:
  // Sizes of a nudge, as shares of the bounds, drawn evenly in their logarithm.
  static constexpr double smallest_nudge = 1e-3;
  static constexpr double largest_nudge = 0.5;
  static constexpr double silent_share = 0.5;  // of the changes of an axis in all edges leave nothing along it
  static constexpr double weakest = 1e-3;      // of the factors that weaken all edges, drawn evenly in their logarithm
  static constexpr double axis_share = 0.5;    // of the nudges are along one axis
  static constexpr double end_share = 0.15;    // of the nudges set an axis to zero or to a bound
  static constexpr double rest_share = 0.5;    // of the edges that are cut go on without a wrench

  // With a clock.
  static constexpr double all_share = 0.5;    // of the shifts, and of the pushes that become one, take all edges
  static constexpr double small_share = 0.5;  // of the shifts are small
  static constexpr double tiny = 1e-300;      // instead of a bound of 0, where the wrench is 0 too

  // An object that is about to leave by itself needs next to nothing. Along one axis it may need nothing at all.
  void weaken_all(TimedEdges& edges) {
    const double factor = portable::exp(rng_.uniformReal(portable::log(weakest), 0.0));
    if (rng_.uniform01() < axis_share) {
      const int axis = draw_axis();
      const bool silent = rng_.uniform01() < silent_share;
      for (TimedEdge& edge : edges) edge.wrenches[axis] *= silent ? 0.0 : factor;
    } else {
      for (TimedEdge& edge : edges) edge.wrenches *= factor;
    }
  }

  void cut(TimedEdges& edges) {
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

  void merge(TimedEdges& edges) {
    if (edges.size() < 2) return;
    const TimedEdge& first = edges[0];
    TimedEdge& second = edges[1];
    const int steps = first.steps + second.steps;
    second.wrenches = (first.steps * first.wrenches + second.steps * second.wrenches) / steps;
    second.steps = std::min(steps, largest_.steps);
    second.start = first.start;
    edges.erase(edges.begin());
  }

  // All objects but one are left alone.
  void silence(TimedEdges& edges) {
    const auto objects = static_cast<int>(largest_.wrenches.size()) / wrench_axes;
    const int disturbed = rng_.uniformInt(0, objects - 1);
    for (TimedEdge& edge : edges) {
      for (int axis = 0; axis < edge.wrenches.size(); ++axis) {
        if (axis / wrench_axes != disturbed) edge.wrenches[axis] = 0.0;
      }
    }
  }

  // All edges, or those from one of them on, come later or earlier: as far as there is time, or by a little.
  void shift(TimedEdges& edges) {
    const auto last = static_cast<int>(edges.size()) - 1;
    const int first = rng_.uniform01() < all_share ? 0 : rng_.uniformInt(0, last);
    const int most = std::max(*horizon_ - 1 - edges[static_cast<std::size_t>(first)].start, 0);
    const int least = -std::min(edges[static_cast<std::size_t>(first)].start, *horizon_);
    int steps = rng_.uniformInt(least, most);
    if (rng_.uniform01() < small_share) steps = static_cast<int>(steps * draw_size());
    if (steps == 0) steps = 1 - 2 * rng_.uniformInt(0, 1);
    for (int i = first; i <= last; ++i) edges[static_cast<std::size_t>(i)].start += steps;
  }

  // The first few edges become one push with all their impulse, or a little less, as strong and early as can be.
  void hasten(TimedEdges& edges) {
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

  TimedEdge nudge(TimedEdge edge) {
    const double size = draw_size();
    nudge_wrenches(edge.wrenches, size);
    const double steps = edge.steps * portable::exp(size * rng_.gaussian01());
    edge.steps = std::clamp(static_cast<int>(std::lround(steps)) + rng_.uniformInt(-1, 1), 1, largest_.steps);
    return edge;
  }

  void nudge_wrenches(Eigen::VectorXd& wrenches, double size) {
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

  int draw_axis() { return axes_[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(axes_.size()) - 1))]; }

  double draw_size() {
    return portable::exp(rng_.uniformReal(portable::log(smallest_nudge), portable::log(largest_nudge)));
  }

  const Edge& largest_;
  std::optional<int> horizon_;
  Draws& rng_;
  std::vector<Change> changes_;
  std::vector<int> axes_;  // that have bounds above 0
};

//! An edge of an escape, and the states between which it leads.
struct Passage {
  Edge edge;
  State from, to;
};

//! The same way at a lower speed. The kinetic energy falls with the square of the speed and what friction, impacts and
//! the top of a barrier take of it is saved; the potential energy is that of the poses. So each push has to do the work
//! that it did, less the kinetic energy that it need not give any more. Where the object coasted it is pushed on.
class SlowMotion {
 public:
  //! `largest` bounds the edges, and has to outlive this.
  SlowMotion(const Problem& problem, const Edge& largest)
      : energy_(problem.scene),
        kinematics_(problem.scene),
        objects_(problem.scene.with_role(Role::object)),
        largest_(largest),
        step_(problem.scene.stepping().step) {}

  //! The edges at the `slowdown`-th part of the speed that a frame sees which moves with the velocities of `frame`. The
  //! first push does `surplus` times more work, relative to that.
  TimedEdges operator()(const std::vector<Passage>& escape, const State& frame, double slowdown, double surplus) const {
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

 private:
  // As strong as it was, or as the bounds let it be.
  static Eigen::VectorXd bounded(const Eigen::VectorXd& wrenches, const Eigen::VectorXd& bounds) {
    double scale = 1.0;
    for (Eigen::Index axis = 0; axis < wrenches.size(); ++axis) {
      if (std::abs(wrenches[axis]) > bounds[axis]) scale = std::min(scale, bounds[axis] / std::abs(wrenches[axis]));
    }
    return (scale * wrenches).cwiseMin(bounds).cwiseMax(-bounds);  // rounding
  }

  double work(const Eigen::VectorXd& wrenches, const Passage& passage, const State& frame) const {
    const double time = passage.edge.steps * step_;
    double work = 0.0;
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      const BodyState from = kinematics_(passage.from.data(), objects_[i]);
      const BodyState to = kinematics_(passage.to.data(), objects_[i]);
      const BodyState moving = kinematics_(frame.data(), objects_[i]);
      const auto wrench = wrenches.segment<wrench_axes>(static_cast<Eigen::Index>(i) * wrench_axes);
      work += wrench.head<3>().dot(to.position - from.position - time * moving.velocity);
      work += wrench.tail<3>().dot(rotation(from, to) - time * moving.angular_velocity);
    }
    return work;
  }

  Energy energy_;
  Kinematics kinematics_;
  std::vector<std::size_t> objects_;  // by their indices in the scene
  const Edge& largest_;
  double step_;  // [s]
};

}  // namespace energymargin::search

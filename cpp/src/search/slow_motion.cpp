#include "search/slow_motion.hpp"

#include <algorithm>
#include <cmath>

#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

// As strong as it was, or as the bounds let it be.
Eigen::VectorXd bounded(const Eigen::VectorXd& wrenches, const Eigen::VectorXd& bounds) {
  double scale = 1.0;
  for (Eigen::Index axis = 0; axis < wrenches.size(); ++axis) {
    if (std::abs(wrenches[axis]) > bounds[axis]) scale = std::min(scale, bounds[axis] / std::abs(wrenches[axis]));
  }
  return (scale * wrenches).cwiseMin(bounds).cwiseMax(-bounds);  // rounding
}

}  // namespace

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

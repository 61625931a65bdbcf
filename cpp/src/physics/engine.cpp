#include "physics/engine.hpp"

#include <cmath>

namespace energymargin {
namespace {

constexpr int steps_between_looks = 16;  // at the limit: a step takes from 3 us to, in large scenes, some ms

}  // namespace

Rollout Engine::rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch,
                        bool audited) {
  simulation_.restore(state);
  std::optional<Auditor> auditor;
  if (audited) auditor.emplace(simulation_, energy_);
  Rollout result;
  std::optional<Robot> other;
  if (watch.plan) other.emplace(simulation_.scene(), *watch.plan);
  const std::optional<Robot>& followed = other ? other : robot_;
  const Robot* const robot = followed ? &*followed : nullptr;
  auto next = watch.record.begin();
  bool over = false;
  for (auto push = pushes.begin(); push != pushes.end() && !over; ++push) {
    const std::vector<Load> acting = loads(*push);
    for (int i = 0; i < push->steps && !over; ++i) {
      result.complete = result.steps % steps_between_looks != 0 || !limit.reached();
      over = !result.complete;
      if (over) break;
      if (i == 0 || robot) load(acting, robot, watch.first + result.steps);
      step(acting, result, auditor ? &*auditor : nullptr);
      ++result.steps;
      if (next != watch.record.end() && *next == result.steps) {
        result.recorded.push_back({result.steps, result.effort, {}});
        simulation_.read(result.recorded.back().state);
        ++next;
      }
      over = !(watch.cost + result.effort < watch.bound);
      if (over || !watch.ends || (watch.first + result.steps) % watch.look_every != 0) continue;
      simulation_.read(result.state);
      over = watch.ends(result.state);
    }
  }
  simulation_.read(result.state);
  if (!std::isfinite(result.effort)) throw Diverged("the effort");
  if (auditor) {
    result.audit = auditor->audit();
    result.audit->energy_change = energy_(result.state) - energy_(state);
    result.audit->wrench = result.work;
  }
  return result;
}

// What a push is on each object.
std::vector<Load> Engine::loads(const Push& push) const {
  std::vector<Load> loads;
  for (Eigen::Index first = 0; first < push.wrenches.size(); first += wrench_axes) {
    const double* const wrench = push.wrenches.data() + first;
    loads.push_back({body_index(*simulation_.objects()[loads.size()]), vector(wrench), vector(wrench + 3)});
  }
  return loads;
}

// The loads act in the next step, and in those after it if there is no robot.
void Engine::load(const std::vector<Load>& loads, const Robot* robot, int step) {
  simulation_.unload();
  for (const Load& load : loads) simulation_.load(load);
  if (robot) robot->act(simulation_, step);
}

void Engine::step(const std::vector<Load>& loads, Rollout& result, Auditor* auditor) {
  double left = simulation_.scene().stepping().step;
  bool converged = true;
  for (int parts = 0; left > 0.0; ++parts) {
    if (auditor) auditor->begin();
    before_.clear();
    for (std::size_t i = 0; i < loads.size(); ++i) before_.push_back(simulation_.velocity(i));
    const PartResult part = simulation_.advance(left, parts);
    for (std::size_t i = 0; i < loads.size(); ++i) {
      const double work = loads[i].power(before_[i], simulation_.pushed(i)) * part.duration;
      result.effort += std::abs(work);
      result.work += work;
    }
    if (auditor) auditor->end(part);
    left -= part.duration;
    result.lost_time += part.lost;
    converged = converged && part.converged;
  }
  if (!converged) ++result.unconverged;
}

std::vector<Frame> Engine::simulate(const State& state, const Robot* second, int steps, const std::vector<int>& record,
                                    const Limit& limit) {
  std::vector<Frame> frames;
  auto next = record.begin();
  if (next != record.end() && *next == 0) {
    frames.push_back({0.0, state, contacts(state)});
    ++next;
  }
  const double step = simulation_.scene().stepping().step;
  int unconverged = 0;
  double lost_time = 0.0;
  simulation_.restore(state);
  for (int i = 1; i <= steps && next != record.end(); ++i) {
    if (i % steps_between_looks == 0) limit.require();
    simulation_.unload();
    if (robot_) robot_->act(simulation_, i - 1);
    if (second) second->act(simulation_, i - 1);
    const PartResult whole = simulation_.step();
    unconverged += whole.converged ? 0 : 1;
    lost_time += whole.lost;
    if (i != *next) continue;
    frames.push_back({i * step, {}, simulation_.contacts(), unconverged, lost_time});
    simulation_.read(frames.back().state);
    ++next;
  }
  return frames;
}

std::vector<Contact> Engine::contacts(const State& state) {
  simulation_.restore(state);
  simulation_.step();
  return simulation_.contacts();
}

}  // namespace energymargin

// Rollouts, step by step.

#include <cmath>

#include "physics/engine.hpp"

namespace energymargin {
namespace {

constexpr int steps_between_checks = 16;  // of the limit: a step takes from 3 us to, in large scenes, some ms

// What a push is on each object.
std::vector<Load> loads_of(const Push& push, const Simulation& simulation) {
  std::vector<Load> loads;
  for (Eigen::Index first = 0; first < push.wrenches.size(); first += wrench_axes) {
    const double* const wrench = push.wrenches.data() + first;
    loads.push_back({body_index(*simulation.objects()[loads.size()]), vector(wrench), vector(wrench + 3)});
  }
  return loads;
}

}  // namespace

void Engine::step(const std::vector<Load>& loads, Rollout& result, Auditor* auditor) {
  double left = simulation.scene().stepping().step;
  bool converged = true;
  for (int substeps = 0; left > 0.0; ++substeps) {
    if (auditor) auditor->begin();
    before.clear();
    for (std::size_t i = 0; i < loads.size(); ++i) before.push_back(simulation.velocity(i));
    const SubstepResult substep = simulation.advance(left, substeps);
    for (std::size_t i = 0; i < loads.size(); ++i) {
      const double work = loads[i].power(before[i], simulation.pushed(i)) * substep.duration;
      result.effort += std::abs(work);
      result.work += work;
    }
    if (auditor) auditor->end(substep);
    left -= substep.duration;
    result.lost_time += substep.lost;
    converged = converged && substep.converged;
  }
  if (!converged) ++result.unconverged;
}

Rollout World::rollout_unchecked(const State& state, const std::vector<Push>& pushes, const Limit& limit,
                                 const Watch& watch) {
  Simulation& simulation = engine_->simulation;
  simulation.restore(state);
  std::optional<Auditor> auditor;
  if (watch.audit) auditor.emplace(simulation, engine_->energy);
  Rollout result;
  std::optional<Robot> other;
  if (watch.plan) other.emplace(simulation.scene(), *watch.plan);
  const std::optional<Robot>& robot = other ? other : engine_->robot;
  auto next = watch.record.begin();
  bool over = false;
  for (auto push = pushes.begin(); push != pushes.end() && !over; ++push) {
    const std::vector<Load> loads = loads_of(*push, simulation);
    for (int i = 0; i < push->steps && !over; ++i) {
      result.complete = result.steps % steps_between_checks != 0 || !limit.reached();
      over = !result.complete;
      if (over) break;
      if (i == 0 || robot) {
        simulation.unload();
        for (const Load& load : loads) simulation.load(load);
        if (robot) robot->act(simulation, watch.first + result.steps);
      }
      engine_->step(loads, result, auditor ? &*auditor : nullptr);
      ++result.steps;
      if (next != watch.record.end() && *next == result.steps) {
        result.recorded.push_back({result.steps, result.effort, {}});
        simulation.read(result.recorded.back().state);
        ++next;
      }
      over = !(watch.cost + result.effort < watch.bound);
      if (over || !watch.ends || (watch.first + result.steps) % watch.look_every != 0) continue;
      simulation.read(result.state);
      over = watch.ends(result.state);
    }
  }
  simulation.read(result.state);
  if (!std::isfinite(result.effort)) throw Diverged("the effort");
  if (auditor) {
    result.audit = auditor->audit();
    result.audit->energy_change = engine_->energy(result.state) - engine_->energy(state);
    result.audit->wrench = result.work;
  }
  return result;
}

std::vector<Frame> World::simulate(const State& state, const Plan& besides, int steps, const std::vector<int>& record,
                                   const Limit& limit) {
  validate_simulation(state, besides, steps, record);
  Simulation& simulation = engine_->simulation;
  std::optional<Robot> second;
  if (besides.rows() > 0) {
    Plan rows = besides;
    rows.step = scene().stepping().step;
    validate(rows, scene(), "drives");
    second.emplace(scene(), rows);
  }
  std::vector<Frame> frames;
  auto next = record.begin();
  if (next != record.end() && *next == 0) {
    frames.push_back({0.0, state, contacts(state)});
    ++next;
  }
  const double step = scene().stepping().step;
  Frame counts;
  simulation.restore(state);
  for (int i = 1; i <= steps && next != record.end(); ++i) {
    if (i % steps_between_checks == 0) limit.require();
    simulation.unload();
    for (const std::optional<Robot>* robot : {&std::as_const(engine_->robot), &std::as_const(second)}) {
      if (*robot) (*robot)->act(simulation, i - 1);
    }
    Rollout whole;
    engine_->step({}, whole, nullptr);
    counts.unconverged += whole.unconverged;
    counts.lost_time += whole.lost_time;
    if (i != *next) continue;
    frames.push_back({i * step, {}, simulation.contacts(), counts.unconverged, counts.lost_time});
    simulation.read(frames.back().state);
    ++next;
  }
  return frames;
}

std::vector<Contact> World::contacts(const State& state) {
  validate(scene(), state);
  engine_->simulation.restore(state);
  Rollout whole;
  engine_->step({}, whole, nullptr);
  return engine_->simulation.contacts();
}

}  // namespace energymargin

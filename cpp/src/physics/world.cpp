// Validates what comes in; what goes out is a pure function of it.

#include "energymargin/world.hpp"

#include <utility>
#include <vector>

#include "base/check.hpp"
#include "physics/engine.hpp"
#include "scene/plan_checks.hpp"

namespace energymargin {
namespace {

void validate_record(const std::vector<int>& record, int steps) {
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (record[i] < 0 || record[i] > steps || (i > 0 && record[i] <= record[i - 1])) {
      reject("record", "with " + std::to_string(record[i]),
             "ascending numbers of steps from 0 to " + std::to_string(steps));
    }
  }
}

void require_a_row_a_step(const std::string& name, Eigen::Index rows, int steps) {
  if (rows != steps) reject(name, std::to_string(rows) + " rows", std::to_string(steps) + " rows, one a step");
}

void require_steps(int steps) {
  require_at_least("steps", steps, 1);
  if (steps > most_steps) reject("steps", std::to_string(steps), "at most " + std::to_string(most_steps));
}

}  // namespace

World::World(const Scene& scene) : engine_(std::make_unique<Engine>(scene, nullptr)) {}
World::World(const Scene& scene, const Plan& plan) {
  validate(plan, scene);
  engine_ = std::make_unique<Engine>(scene, &plan);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const { return engine_->simulation().scene(); }
const StateLayout& World::layout() const { return engine_->simulation().layout(); }

Rollout World::rollout(const State& state, const Disturbance& wrenches, double duration, bool audit, const Limit& limit,
                       double time) {
  validate(scene(), state);
  const std::size_t objects = engine_->simulation().objects().size();
  if (wrenches.size() != objects) {
    reject("wrenches", std::to_string(wrenches.size()) + " wrenches", std::to_string(objects) + ", one an object");
  }
  for (const Wrench& wrench : wrenches) {
    require_finite("wrench force", wrench.force);
    require_finite("wrench torque", wrench.torque);
  }
  for (const auto& [name, seconds] : {std::pair{"duration", duration}, std::pair{"time", time}}) {
    require_not_negative(name, seconds);
    if (seconds > most_steps * scene().stepping().step) {
      reject(name, text(seconds), "at most " + std::to_string(most_steps) + " steps");
    }
  }
  const int steps = engine_->simulation().whole_steps(duration);
  Watch watch;
  watch.first = engine_->simulation().whole_steps(time);
  Rollout result = audit ? engine_->audited_rollout(state, {{wrenches, steps}}, limit, watch)
                         : rollout_unchecked(state, wrenches, steps, limit, watch);
  if (!result.complete) limit.require();
  result.energy = engine_->energy()(result.state);
  return result;
}

Rollout World::rollout_unchecked(const State& state, const Disturbance& wrenches, int steps, const Limit& limit,
                                 const Watch& watch) {
  return engine_->rollout(state, {{wrenches, steps}}, limit, watch);
}

Rollout World::rollout_unchecked(const State& state, const std::vector<Push>& pushes, const Limit& limit,
                                 const Watch& watch) {
  return engine_->rollout(state, pushes, limit, watch);
}

std::vector<Frame> World::simulate(const State& state, const Script& script, int steps, const std::vector<int>& record,
                                   const Limit& limit) {
  validate(scene(), state);
  require_steps(steps);
  validate_record(record, steps);
  if (script.drives.empty() && script.targets.empty()) return engine_->simulate(state, nullptr, steps, record, limit);
  for (const Drive& drive : script.drives) {
    require_a_row_a_step("drives['" + drive.body + "']", drive.wrenches.rows(), steps);
  }
  for (const Targets& targets : script.targets) {
    require_a_row_a_step("targets['" + targets.joint + "']", targets.positions.size(), steps);
  }
  const Plan plan{scene().stepping().step, script.drives, script.targets};
  validate(plan, scene(), "drives");
  const Robot scripted(scene(), plan);
  return engine_->simulate(state, &scripted, steps, record, limit);
}

double World::energy(const State& state) const {
  validate(scene(), state);
  return engine_->energy()(state);
}

std::vector<Contact> World::contacts(const State& state) {
  validate(scene(), state);
  return engine_->contacts(state);
}

double World::distance(const State& state, const std::string& body_a, const std::string& body_b) {
  const std::size_t a = scene().index(body_a);
  const std::size_t b = scene().index(body_b);
  if (a == b) reject("body_b", "'" + body_b + "'", "another body than body_a");
  validate(scene(), state);
  engine_->simulation().restore(state);
  return engine_->simulation().closest_points(a, b, 1e9).distance;
}

Contact World::deepest_contact(const State& state) {
  validate(scene(), state);
  Simulation& simulation = engine_->simulation();
  simulation.restore(state);
  const std::vector<Body>& bodies = scene().bodies();
  Contact deepest;
  for (const auto& [a, b] : simulation.near_pairs()) {
    const ClosestPoints points = simulation.closest_points(a, b, 0.0);
    if (points.distance >= deepest.distance) continue;
    deepest.body_a = bodies[a].name;
    deepest.body_b = bodies[b].name;
    deepest.distance = points.distance;
    deepest.position = points.position;
    deepest.normal = points.normal;
    deepest.friction = scene().contact_friction(a, b);
  }
  return deepest;
}

}  // namespace energymargin

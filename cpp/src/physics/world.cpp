// Validates what comes in; what goes out is a pure function of it.

#include "energymargin/world.hpp"

#include <utility>
#include <vector>

#include "base/check.hpp"
#include "physics/engine.hpp"

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

}  // namespace

Push push(const Disturbance& wrenches, int steps) {
  Push push{Eigen::VectorXd(wrench_axes * static_cast<Eigen::Index>(wrenches.size())), steps};
  Eigen::Index first = 0;
  for (const Wrench& wrench : wrenches) {
    push.wrenches.segment<wrench_axes>(first) << wrench.force, wrench.torque;
    first += wrench_axes;
  }
  return push;
}

World::World(const Scene& scene) : engine_(std::make_unique<Engine>(scene, nullptr)) {}
World::World(const Scene& scene, const Plan& plan) {
  validate(plan, scene);
  engine_ = std::make_unique<Engine>(scene, &plan);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const { return engine_->simulation.scene(); }
const StateLayout& World::layout() const { return engine_->simulation.layout(); }

Rollout World::rollout(const State& state, const Disturbance& wrenches, double duration, bool audit, const Limit& limit,
                       double time) {
  validate(scene(), state);
  const std::size_t objects = engine_->simulation.objects().size();
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
  const int steps = engine_->simulation.whole_steps(duration);
  Watch watch;
  watch.audit = audit;
  watch.first = engine_->simulation.whole_steps(time);
  Rollout result = rollout_unchecked(state, {push(wrenches, steps)}, limit, watch);
  if (!result.complete) limit.require();
  result.energy = engine_->energy(result.state);
  return result;
}

void World::validate_simulation(const State& state, const Plan& besides, int steps,
                                const std::vector<int>& record) const {
  validate(scene(), state);
  require_at_least("steps", steps, 1);
  if (steps > most_steps) reject("steps", std::to_string(steps), "at most " + std::to_string(most_steps));
  validate_record(record, steps);
  for (const Drive& drive : besides.wrenches) {
    require_a_row_a_step("drives['" + drive.body + "']", drive.wrenches.rows(), steps);
  }
  for (const Targets& targets : besides.targets) {
    require_a_row_a_step("targets['" + targets.joint + "']", targets.positions.size(), steps);
  }
}

double World::energy(const State& state) const {
  validate(scene(), state);
  return engine_->energy(state);
}

double World::distance(const State& state, const std::string& body_a, const std::string& body_b) {
  const std::size_t a = scene().index(body_a);
  const std::size_t b = scene().index(body_b);
  if (a == b) reject("body_b", "'" + body_b + "'", "another body than body_a");
  const auto closest = placement_at(state).pairs.closest(a, b, 1e9);
  return closest ? closest->distance : std::numeric_limits<double>::infinity();
}

Contact World::deepest_contact(const State& state) { return placement_at(state).deepest_contact(); }

Placement& World::placement_at(const State& state) {
  validate(scene(), state);
  engine_->simulation.restore(state);
  return engine_->simulation.placement();
}

}  // namespace energymargin

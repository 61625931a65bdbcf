// Validates what comes in; what goes out is a pure function of it.

#include "energymargin/world.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "physics/auditor.hpp"
#include "physics/robot.hpp"
#include "physics/shapes.hpp"
#include "physics/simulation.hpp"
#include "scene/energy.hpp"
#include "scene/plan_checks.hpp"

namespace energymargin {

namespace {

constexpr int steps_between_looks = 16;  // at the limit: a step takes from 3 us to, in large scenes, some ms

}  // namespace

namespace {

// A wrench on one object.
class Pushed {
 public:
  Pushed(const btRigidBody& object, const Wrench& wrench)
      : object_(object), force_(to_bullet(wrench.force)), torque_(to_bullet(wrench.torque)) {}

  void load(Simulation& simulation) const {
    simulation.load(static_cast<std::size_t>(object_.getUserIndex()), force_, torque_);
  }

  //! Before a part of a step.
  void begin() {
    velocity_ = object_.getLinearVelocity();
    spin_ = object_.getAngularVelocity();
  }

  //! Of that part. The mean of the velocities before and after makes the work on a free body its gain of kinetic
  //! energy, exactly.
  double work(double duration) const {
    const double power =
        0.5 * (force_.dot(velocity_ + object_.getLinearVelocity()) + torque_.dot(spin_ + object_.getAngularVelocity()));
    return power * duration;
  }

 private:
  const btRigidBody& object_;
  btVector3 force_, torque_;
  btVector3 velocity_, spin_;
};

}  // namespace

class World::Bullet {
 public:
  explicit Bullet(const Scene& scene) : simulation(scene), energy(scene) {}
  Bullet(const Scene& scene, const Plan& plan) : simulation(scene), energy(scene), robot(std::in_place, scene, plan) {}

  //! From where the simulation is; `auditor` may be null.
  Rollout rollout(const std::vector<Push>& pushes, const Limit& limit, const Watch& watch, Auditor* auditor);
  std::vector<Frame> simulate(const State& state, const Robot* along, int steps, const std::vector<int>& record,
                              const Limit& limit);
  std::vector<Contact> contacts(const State& state);
  Rollout audited_rollout(const State& state, const Disturbance& wrenches, int steps, const Limit& limit,
                          const Watch& watch);

  Simulation simulation;
  Energy energy;
  std::optional<Robot> robot;

 private:
  void load(const std::vector<Pushed>& pushed, int step);
  void step(std::vector<Pushed>& pushed, Rollout& result, Auditor* auditor);
};

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

World::World(const Scene& scene) : bullet_(std::make_unique<Bullet>(scene)) {}
World::World(const Scene& scene, const Plan& plan) {
  validate(plan, scene);
  bullet_ = std::make_unique<Bullet>(scene, plan);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

void World::follow(const Plan& plan) { bullet_->robot.emplace(scene(), plan); }

const Scene& World::scene() const { return bullet_->simulation.scene(); }
const StateLayout& World::layout() const { return bullet_->simulation.layout(); }

Rollout World::rollout(const State& state, const Disturbance& wrenches, double duration, bool audit, const Limit& limit,
                       double time) {
  validate(scene(), state);
  const std::size_t objects = bullet_->simulation.objects().size();
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
  const int steps = bullet_->simulation.whole_steps(duration);
  Watch watch;
  watch.first = bullet_->simulation.whole_steps(time);
  Rollout result = audit ? bullet_->audited_rollout(state, wrenches, steps, limit, watch)
                         : rollout_unchecked(state, wrenches, steps, limit, watch);
  if (!result.complete) limit.require();
  result.energy = bullet_->energy(result.state);
  return result;
}

Rollout World::rollout_unchecked(const State& state, const Disturbance& wrenches, int steps, const Limit& limit,
                                 const Watch& watch) {
  bullet_->simulation.restore(state);
  return bullet_->rollout({{wrenches, steps}}, limit, watch, nullptr);
}

Rollout World::rollout_unchecked(const State& state, const std::vector<Push>& pushes, const Limit& limit,
                                 const Watch& watch) {
  bullet_->simulation.restore(state);
  return bullet_->rollout(pushes, limit, watch, nullptr);
}

Rollout World::Bullet::rollout(const std::vector<Push>& pushes, const Limit& limit, const Watch& watch,
                               Auditor* auditor) {
  Rollout result;
  std::vector<Pushed> pushed;
  auto next = watch.record.begin();
  bool over = false;
  for (auto push = pushes.begin(); push != pushes.end() && !over; ++push) {
    pushed.clear();
    for (const Wrench& wrench : push->wrenches) pushed.emplace_back(*simulation.objects()[pushed.size()], wrench);
    for (int i = 0; i < push->steps && !over; ++i) {
      result.complete = result.steps % steps_between_looks != 0 || !limit.reached();
      over = !result.complete;
      if (over) break;
      if (i == 0 || robot) load(pushed, watch.first + result.steps);
      step(pushed, result, auditor);
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
  return result;
}

// For the next step, and for those after it if there is no robot.
void World::Bullet::load(const std::vector<Pushed>& pushed, int step) {
  simulation.unload();
  for (const Pushed& push : pushed) push.load(simulation);
  if (robot) robot->act(simulation, step);
}

void World::Bullet::step(std::vector<Pushed>& pushed, Rollout& result, Auditor* auditor) {
  double left = simulation.scene().stepping().step;
  for (int parts = 0; left > 0.0; ++parts) {
    if (auditor) auditor->begin();
    for (Pushed& push : pushed) push.begin();
    const Advance part = simulation.advance(left, parts);
    for (const Pushed& push : pushed) {
      const double work = push.work(part.duration);
      result.effort += std::abs(work);
      result.work += work;
    }
    if (auditor) auditor->end(part);
    left -= part.duration;
  }
}

Rollout World::Bullet::audited_rollout(const State& state, const Disturbance& wrenches, int steps, const Limit& limit,
                                       const Watch& watch) {
  simulation.restore(state);
  Auditor auditor(simulation, energy);
  Rollout result = rollout({{wrenches, steps}}, limit, watch, &auditor);
  result.energy = energy(result.state);
  result.audit = auditor.audit();
  result.audit->energy_change = result.energy - energy(state);
  result.audit->wrench = result.work;
  return result;
}

std::vector<Frame> World::simulate(const State& state, const Script& script, int steps, const std::vector<int>& record,
                                   const Limit& limit) {
  validate(scene(), state);
  require_steps(steps);
  if (script.drives.empty() && script.targets.empty()) return bullet_->simulate(state, nullptr, steps, record, limit);
  for (const Drive& drive : script.drives) {
    require_a_row_a_step("drives['" + drive.body + "']", drive.wrenches.rows(), steps);
  }
  for (const Targets& targets : script.targets) {
    require_a_row_a_step("targets['" + targets.joint + "']", targets.positions.size(), steps);
  }
  const Plan plan{scene().stepping().step, script.drives, script.targets};
  validate(plan, scene(), "drives");
  const Robot robot(scene(), plan);
  return bullet_->simulate(state, &robot, steps, record, limit);
}

std::vector<Frame> World::simulate(const State& state, int steps, const std::vector<int>& record, const Limit& limit) {
  validate(scene(), state);
  require_steps(steps);
  return bullet_->simulate(state, bullet_->robot ? &*bullet_->robot : nullptr, steps, record, limit);
}

std::vector<Frame> World::Bullet::simulate(const State& state, const Robot* along, int steps,
                                           const std::vector<int>& record, const Limit& limit) {
  validate_record(record, steps);
  std::vector<Frame> frames;
  auto next = record.begin();
  if (next != record.end() && *next == 0) {
    frames.push_back({0.0, state, contacts(state)});
    ++next;
  }
  const double step = simulation.scene().stepping().step;
  simulation.restore(state);
  for (int i = 1; i <= steps && next != record.end(); ++i) {
    if (i % steps_between_looks == 0) limit.require();
    simulation.unload();
    if (along) along->act(simulation, i - 1);
    simulation.step();
    if (i != *next) continue;
    frames.push_back({i * step, {}, simulation.contacts()});
    simulation.read(frames.back().state);
    ++next;
  }
  return frames;
}

std::vector<Contact> World::Bullet::contacts(const State& state) {
  simulation.restore(state);
  simulation.step();
  return simulation.contacts();
}

double World::energy(const State& state) const {
  validate(scene(), state);
  return bullet_->energy(state);
}

std::vector<Contact> World::contacts(const State& state) {
  validate(scene(), state);
  return bullet_->contacts(state);
}

double World::distance(const State& state, const std::string& body_a, const std::string& body_b) {
  const std::size_t a = scene().index(body_a);
  const std::size_t b = scene().index(body_b);
  if (a == b) reject("body_b", "'" + body_b + "'", "another body than body_a");
  validate(scene(), state);
  bullet_->simulation.restore(state);
  return bullet_->simulation.pair(a, b, 1e9).least;
}

Contact World::deepest_contact(const State& state) {
  validate(scene(), state);
  Simulation& simulation = bullet_->simulation;
  simulation.restore(state);
  const std::vector<Body>& bodies = scene().bodies();
  Contact deepest;
  for (std::size_t a = 0; a < bodies.size(); ++a) {
    for (std::size_t b = a + 1; b < bodies.size(); ++b) {
      if (!simulation.can_collide(a, b)) continue;
      const PairPoints points = simulation.pair(a, b, 0.0);
      if (points.least >= deepest.distance) continue;
      deepest.body_a = bodies[a].name;
      deepest.body_b = bodies[b].name;
      deepest.distance = points.least;
      deepest.position = points.position;
      deepest.normal = points.normal;
      deepest.friction = bodies[a].friction * bodies[b].friction;
    }
  }
  return deepest;
}

}  // namespace energymargin

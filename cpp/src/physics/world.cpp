// Validates what comes in; what goes out is a pure function of it.

#include "energymargin/world.hpp"

#include <cmath>
#include <utility>

#include "base/check.hpp"
#include "physics/auditor.hpp"
#include "physics/engine.hpp"
#include "physics/robot.hpp"
#include "physics/simulated.hpp"
#include "scene/records.hpp"

namespace energymargin {
namespace {

constexpr int steps_between_checks = 16;  // of the limit: a step takes from 3 us to, in large scenes, some ms

void validate_simulation(const Plan& besides, int steps, const std::vector<int>& record) {
  require_at_least("steps", steps, 1);
  if (steps > most_steps) reject("steps", std::to_string(steps), "at most " + std::to_string(most_steps));
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (record[i] < 0 || record[i] > steps || (i > 0 && record[i] <= record[i - 1])) {
      reject("record", "with " + std::to_string(record[i]),
             "ascending numbers of steps from 0 to " + std::to_string(steps));
    }
  }
  const auto require_a_row_a_step = [steps](const std::string& name, Eigen::Index rows) {
    if (rows != steps) reject(name, std::to_string(rows) + " rows", std::to_string(steps) + " rows, one a step");
  };
  for (const Drive& drive : besides.wrenches) {
    require_a_row_a_step("drives['" + drive.body + "']", drive.wrenches.rows());
  }
  for (const Targets& targets : besides.targets) {
    require_a_row_a_step("targets['" + targets.joint + "']", targets.positions.size());
  }
}

// What a push is on each object.
std::vector<Load> loads_of(const Push& push, const Engine& engine) {
  std::vector<Load> loads;
  for (Eigen::Index first = 0; first < push.wrenches.size(); first += wrench_axes) {
    const double* const wrench = push.wrenches.data() + first;
    loads.push_back({engine.objects()[loads.size()], vector(wrench), vector(wrench + 3)});
  }
  return loads;
}

}  // namespace

// The robot follows `plan`, which fits the scene, unless it is null.
struct World::Player {
  Player(const Scene& scene, const Plan* plan) : made(make_engine(scene)), energy(scene) {
    if (plan) robot.emplace(engine.scene(), *plan);
    if (scene.stepping().simulator) simulated.emplace(engine, plan);
  }

  const std::unique_ptr<Engine> made;
  Engine& engine = *made;
  Energy energy;
  std::optional<Robot> robot;
  std::optional<SimulatedRollouts> simulated;  // then `engine` steps nothing
  std::vector<LoadedMotion> before{};          // as a substep begins

  // One step under loads, which `acting` feels; its work, effort, lost time and convergence are added to `result`.
  void step(const std::vector<Load>& loads, std::optional<Robot>& acting, Rollout& result, Auditor* auditor) {
    double left = engine.scene().stepping().step;
    bool first = true, converged = true;
    while (left > 0.0) {
      if (auditor) auditor->begin();
      before.clear();
      for (const Load& load : loads) before.push_back(engine.before(load));
      const SubstepResult substep = engine.advance(left);
      for (std::size_t i = 0; i < loads.size(); ++i) {
        const double work = engine.power(loads[i], before[i]) * substep.duration;
        result.effort += std::abs(work);
        result.work += work;
      }
      if (auditor) auditor->end(substep);
      if (acting) acting->feel(engine, std::exchange(first, false));
      left -= substep.duration;
      result.lost_time += substep.lost;
      converged = converged && substep.converged;
    }
    if (!converged) ++result.unconverged;
  }
};

Push push(const Disturbance& wrenches, int steps) {
  Push push{Eigen::VectorXd(wrench_axes * static_cast<Eigen::Index>(wrenches.size())), steps};
  Eigen::Index first = 0;
  for (const Wrench& wrench : wrenches) {
    push.wrenches.segment<wrench_axes>(first) << wrench.force, wrench.torque;
    first += wrench_axes;
  }
  return push;
}

World::World(const Scene& scene) : player_(std::make_unique<Player>(scene, nullptr)) {}
World::World(const Scene& scene, const Plan& plan) {
  validate(plan, scene);
  player_ = std::make_unique<Player>(scene, &plan);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const { return player_->engine.scene(); }
const StateLayout& World::layout() const { return player_->engine.layout(); }
int World::memory() const { return robot_memory() + static_cast<int>(simulator() ? simulator()->memory : 0); }
int World::robot_memory() const { return player_->robot ? static_cast<int>(player_->robot->memory()) : 0; }
const Simulator* World::simulator() const { return scene().stepping().simulator.get(); }

void World::require_own_steps(const std::string& what) const {
  if (simulator())
    reject(what, "with the engine '" + simulator()->name + "'", "engine 'native': that one does not tell");
}

Rollout World::rollout(const State& state, const Disturbance& wrenches, double duration, bool audit, const Limit& limit,
                       double time) {
  validate(scene(), state);
  const std::size_t objects = player_->engine.objects().size();
  if (objects == 0) reject("scene", "without an object", "a body of role \"object\"");
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
  if (audit) require_own_steps("audit");
  if (audit && !player_->engine.impulses()) {
    reject("audit",
           std::string("with engine '") + word_of(scene().stepping().engine) +
               "', which does not tell the work of impulses",
           "engine 'native'");
  }
  const int steps = player_->engine.whole_steps(duration);
  Watch watch;
  watch.audit = audit;
  watch.first = player_->engine.whole_steps(time);
  Rollout result = rollout_unchecked(state, {push(wrenches, steps)}, limit, watch);
  if (!result.complete) limit.require();
  result.state.conservativeResize(layout().dimension());
  result.energy = player_->energy(result.state);
  return result;
}

Rollout World::rollout_unchecked(const State& state, const std::vector<Push>& pushes, const Limit& limit,
                                 const Watch& watch) {
  if (player_->simulated) {
    std::optional<Rollout> rollout = std::move(player_->simulated->run({{state, pushes, watch}}, limit).front());
    if (!rollout) throw Diverged("a state");
    return std::move(*rollout);
  }
  Engine& engine = player_->engine;
  engine.restore(state);
  std::optional<Auditor> auditor;
  if (watch.audit) auditor.emplace(engine, player_->energy);
  Rollout result;
  std::optional<Robot> other;
  if (watch.plan) other.emplace(engine.scene(), *watch.plan);
  std::optional<Robot>& robot = other ? other : player_->robot;
  if (robot) {
    robot->restore(state, engine.layout().dimension());
    robot->take(watch.commands, watch.noise);
  }
  const auto read = [&](State& now) {
    engine.read(now);
    if (!robot || robot->memory() == 0) return;
    now.conservativeResize(now.size() + robot->memory());
    now.tail(robot->memory()) = robot->remembered();
  };
  auto next = watch.record.begin();
  bool over = false;
  for (auto push = pushes.begin(); push != pushes.end() && !over; ++push) {
    const std::vector<Load> loads = loads_of(*push, engine);
    for (int i = 0; i < push->steps && !over; ++i) {
      result.complete = result.steps % steps_between_checks != 0 || !limit.reached();
      over = !result.complete;
      if (over) break;
      if (i == 0 || robot) {
        engine.unload();
        for (const Load& load : loads) engine.load(load);
        over = robot && !robot->act(engine, watch.first + result.steps, limit);
        result.complete = !over;
        if (over) break;
      }
      player_->step(loads, robot, result, auditor ? &*auditor : nullptr);
      ++result.steps;
      if (next != watch.record.end() && *next == result.steps) {
        result.recorded.push_back({result.steps, result.effort, {}});
        read(result.recorded.back().state);
        ++next;
      }
      over = !(watch.cost + result.effort < watch.bound);
      if (over || !watch.ends || (watch.first + result.steps) % watch.check_every != 0) continue;
      read(result.state);
      over = watch.ends(result.state);
    }
  }
  read(result.state);
  if (!std::isfinite(result.effort)) throw Diverged("the effort");
  if (auditor) {
    result.audit = auditor->audit();
    result.audit->energy_change = player_->energy(result.state) - player_->energy(state);
    result.audit->wrench = result.work;
  }
  return result;
}

std::vector<std::optional<Rollout>> World::rollouts_unchecked(const std::vector<RolloutQuestion>& questions,
                                                              const Limit& limit) {
  return player_->simulated->run(questions, limit);
}

std::vector<Frame> World::simulate(const State& state, const Plan& besides, int steps, const std::vector<int>& record,
                                   const Limit& limit) {
  validate(scene(), state);
  validate_simulation(besides, steps, record);
  if (player_->simulated) return simulate_elsewhere(state, besides, record, limit);
  Engine& engine = player_->engine;
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
    frames.push_back({0.0, state, {}, contacts(state)});
    ++next;
  }
  const double step = scene().stepping().step;
  Rollout whole;
  engine.restore(state);
  if (player_->robot) {
    player_->robot->restore(state, layout().dimension());
    player_->robot->take(nullptr, nullptr);
    if (!frames.empty()) frames.front().memory = player_->robot->remembered();
  }
  for (int i = 1; i <= steps && next != record.end(); ++i) {
    if (i % steps_between_checks == 0) limit.require();
    engine.unload();
    for (std::optional<Robot>* robot : {&player_->robot, &second}) {
      if (*robot && !(*robot)->act(engine, i - 1, limit)) limit.require();
    }
    player_->step({}, player_->robot, whole, nullptr);
    if (i != *next) continue;
    frames.push_back({i * step, {}, {}, engine.contacts(), whole.unconverged, whole.lost_time});
    engine.read(frames.back().state);
    if (player_->robot) frames.back().memory = player_->robot->remembered();
    ++next;
  }
  return frames;
}

std::vector<Frame> World::simulate_elsewhere(const State& state, const Plan& besides, std::vector<int> record,
                                             const Limit& limit) {
  if (besides.rows() > 0) require_own_steps("drives or targets");
  std::vector<Frame> frames;
  if (!record.empty() && record.front() == 0) {
    frames.push_back({0.0, state, Eigen::VectorXd::Zero(robot_memory())});
    record.erase(record.begin());
  }
  if (record.empty()) return frames;
  Watch watch;
  watch.record = record;
  const auto objects = static_cast<Eigen::Index>(player_->engine.objects().size());
  const Push none{Eigen::VectorXd::Zero(wrench_axes * objects), record.back()};
  const Rollout rollout = rollout_unchecked(state, {none}, limit, watch);
  if (!rollout.complete) limit.require();
  for (const Moment& moment : rollout.recorded) {
    frames.push_back({moment.steps * scene().stepping().step, moment.state.head(layout().dimension()),
                      moment.state.tail(robot_memory())});
  }
  return frames;
}

std::vector<Contact> World::contacts(const State& state) {
  require_own_steps("contacts");
  validate(scene(), state);
  player_->engine.restore(state);
  Rollout whole;
  player_->step({}, player_->robot, whole, nullptr);
  return player_->engine.contacts();
}

double World::energy(const State& state) const {
  validate(scene(), state);
  return player_->energy(state);
}

double World::distance(const State& state, const std::string& body_a, const std::string& body_b) {
  const std::size_t a = scene().index(body_a);
  const std::size_t b = scene().index(body_b);
  if (a == b) reject("body_b", "'" + body_b + "'", "another body than body_a");
  validate(scene(), state);
  player_->engine.restore(state);
  const auto closest = player_->engine.pairs().closest(a, b, 1e9);
  return closest ? closest->distance : std::numeric_limits<double>::infinity();
}

Contact deepest_contact(const Scene& scene, const State& state) {
  MovingBodies bodies(scene);
  bodies.restore(state);
  CollisionPairs pairs(scene, bodies.poses());
  Contact deepest;
  for (const auto& [a, b] : pairs.near()) {
    const auto closest = pairs.closest(a, b, 0.0);
    if (!closest || closest->distance >= deepest.distance) continue;
    deepest = {scene.bodies()[a].name, scene.bodies()[b].name, from_bullet(closest->on_b), from_bullet(closest->normal),
               closest->distance};
    deepest.friction = scene.contact_friction(a, b);
  }
  return deepest;
}

}  // namespace energymargin

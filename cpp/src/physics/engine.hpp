#pragma once
// Rollouts and simulations of one scene, without validation.

#include <optional>
#include <vector>

#include "energymargin/world.hpp"
#include "physics/auditor.hpp"
#include "physics/robot.hpp"
#include "physics/simulation.hpp"
#include "scene/energy.hpp"

namespace energymargin {

//! What a World answers with, once its arguments are valid.
class Engine {
 public:
  //! The robot follows `plan`, which fits the scene, in rollouts and simulations, unless it is null.
  Engine(const Scene& scene, const Plan* plan) : simulation_(scene), energy_(scene) {
    if (plan) robot_.emplace(simulation_.scene(), *plan);
  }

  Simulation& simulation() { return simulation_; }
  const Simulation& simulation() const { return simulation_; }
  const Energy& energy() const { return energy_; }

  Rollout rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch);

  //! The same with the balance of its energy.
  Rollout audited_rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch);

  //! Recorded after the steps in `record`. What is `scripted`, unless it is null, comes on top of the plan. Throws
  //! Cancelled or TimedOut if it reaches the limit.
  std::vector<Frame> simulate(const State& state, const Robot* scripted, int steps, const std::vector<int>& record,
                              const Limit& limit);

  //! With the forces of one step without a wrench.
  std::vector<Contact> contacts(const State& state);

 private:
  class ObjectWrench;

  Rollout run(const std::vector<Push>& pushes, const Limit& limit, const Watch& watch, Auditor* auditor);
  void load(const std::vector<ObjectWrench>& wrenches, const Robot* robot, int step);
  void step(std::vector<ObjectWrench>& wrenches, Rollout& result, Auditor* auditor);

  Simulation simulation_;
  Energy energy_;
  std::optional<Robot> robot_;
};

}  // namespace energymargin

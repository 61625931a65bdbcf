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
  explicit Engine(const Scene& scene) : simulation(scene), energy(scene) {}
  Engine(const Scene& scene, const Plan& plan) : simulation(scene), energy(scene), robot(std::in_place, scene, plan) {}

  Rollout rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch);

  //! The same with the balance of its energy.
  Rollout audited_rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch);

  //! Recorded after the steps in `record`; `along` may be null. Throws Cancelled or TimedOut if it reaches the limit.
  std::vector<Frame> simulate(const State& state, const Robot* along, int steps, const std::vector<int>& record,
                              const Limit& limit);

  //! With the forces of one step without a wrench.
  std::vector<Contact> contacts(const State& state);

  Simulation simulation;
  Energy energy;
  std::optional<Robot> robot;

 private:
  class ObjectWrench;

  Rollout roll_out(const std::vector<Push>& pushes, const Limit& limit, const Watch& watch, Auditor* auditor);
  void load(const std::vector<ObjectWrench>& wrenches, int step);
  void step(std::vector<ObjectWrench>& wrenches, Rollout& result, Auditor* auditor);
};

}  // namespace energymargin

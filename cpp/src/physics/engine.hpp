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

  //! It has the balance of its energy if it is `audited`.
  Rollout rollout(const State& state, const std::vector<Push>& pushes, const Limit& limit, const Watch& watch,
                  bool audited = false);

  //! Recorded after the steps in `record`. A second robot, unless it is null, acts too. Throws Cancelled or TimedOut if
  //! it reaches the limit.
  std::vector<Frame> simulate(const State& state, const Robot* second, int steps, const std::vector<int>& record,
                              const Limit& limit);

  //! They have the forces of one step without a wrench.
  std::vector<Contact> contacts(const State& state);

 private:
  std::vector<Load> loads(const Push& push) const;
  void load(const std::vector<Load>& loads, const Robot* robot, int step);
  void step(const std::vector<Load>& loads, Rollout& result, Auditor* auditor);

  Simulation simulation_;
  Energy energy_;
  std::optional<Robot> robot_;
  std::vector<Velocity> before_;  // of the objects, as a part of a step begins
};

}  // namespace energymargin

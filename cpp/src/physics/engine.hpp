#pragma once
// What a World is made of.

#include <optional>
#include <vector>

#include "physics/auditor.hpp"
#include "physics/robot.hpp"
#include "physics/simulation.hpp"
#include "scene/energy.hpp"

namespace energymargin {

//! The robot follows `plan`, which fits the scene, unless it is null.
struct Engine {
  Engine(const Scene& scene, const Plan* plan) : simulation(scene), energy(scene) {
    if (plan) robot.emplace(simulation.scene(), *plan);
  }

  Simulation simulation;
  Energy energy;
  std::optional<Robot> robot;
  std::vector<Velocity> before{};  // of the objects, as a substep begins

  //! One step under loads on the objects; its work, effort, lost time and convergence are added to `result`.
  void step(const std::vector<Load>& loads, Rollout& result, Auditor* auditor);
};

}  // namespace energymargin

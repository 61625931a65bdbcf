#pragma once
// What a World is made of.

#include <optional>
#include <vector>

#include "energymargin/plan.hpp"
#include "physics/auditor.hpp"
#include "physics/simulation.hpp"

namespace energymargin {

//! Does in each step what a plan says.
class Robot {
 public:
  //! The plan fits the scene.
  Robot(const Scene& scene, const Plan& plan);

  //! Loads the simulation with what acts in a step, counted from the plan's start. Behind its end nothing acts but the
  //! last targets.
  void act(Simulation& simulation, int step) const;

 private:
  Plan plan_;
  std::vector<std::size_t> wrench_bodies_, servo_bodies_;
  std::vector<std::size_t> joints_;
};

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

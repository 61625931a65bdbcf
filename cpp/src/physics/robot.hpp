#pragma once
// A plan, as it goes.

#include <cstddef>
#include <vector>

#include "energymargin/plan.hpp"
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

}  // namespace energymargin

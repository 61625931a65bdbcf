#pragma once
// Steps that are cut into parts, where bodies would pass into each other.

#include "physics/simulation.hpp"

namespace energymargin::scenes {

//! How many of the steps from `state` on are; the simulation is left at the end of them.
inline int cut_steps(Simulation& simulation, const State& state, int steps) {
  simulation.restore(state);
  const double whole = simulation.scene().stepping().step;
  int count = 0;
  for (int i = 0; i < steps; ++i) {
    const double first = simulation.advance(whole).duration;
    count += first < whole ? 1 : 0;
    double left = whole - first;
    while (left > 0.0) left -= simulation.advance(left).duration;
  }
  return count;
}

inline int cut_steps(const Scene& scene, const State& state, int steps) {
  Simulation simulation(scene);
  return cut_steps(simulation, state, steps);
}

}  // namespace energymargin::scenes

#pragma once
// Steps that are cut into parts, where bodies would pass into each other.

#include "physics/native/native_engine.hpp"

namespace energymargin::scenes {

//! How many of the steps from `state` on are; the engine is left at the end of them.
inline int cut_steps(Engine& engine, const State& state, int steps) {
  engine.restore(state);
  const double whole = engine.scene().stepping().step;
  int count = 0;
  for (int i = 0; i < steps; ++i) {
    const double first = engine.advance(whole).duration;
    count += first < whole ? 1 : 0;
    double left = whole - first;
    while (left > 0.0) left -= engine.advance(left).duration;
  }
  return count;
}

inline int cut_steps(const Scene& scene, const State& state, int steps) {
  NativeEngine engine(scene);
  return cut_steps(engine, state, steps);
}

}  // namespace energymargin::scenes

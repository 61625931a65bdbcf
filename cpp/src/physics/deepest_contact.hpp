#pragma once
// How deep bodies are in each other at one state.

#include "energymargin/world.hpp"

namespace energymargin {

//! As World::deepest_contact, of a valid state: poses and shapes tell it, without a simulation.
Contact deepest_contact(const Scene& scene, const State& state);

}  // namespace energymargin

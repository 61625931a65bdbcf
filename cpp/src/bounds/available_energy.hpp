#pragma once
// The energy that may help an object out without a disturbance, and which bodies have none.

#include <string>
#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin::bounds {

//! By body of the scene: fixed ones, those whose axes are all locked, and links that hang on them by joints that are
//! fixed or held. With a plan held joints may move.
std::vector<bool> immovable_bodies(const Problem& problem);

struct AvailableEnergy {
  double kinetic = 0.0;  //!< of all bodies at the start [J]
  double stored = 0.0;   //!< that all but the object can release: springs, joints, weights [J]; inf: no end of it
  std::string reason{};  //!< why there is no end of it; empty if there is

  double total() const { return kinetic + stored; }
};

//! Of a problem's start. `immovable`: by body of the scene.
AvailableEnergy available_energy(const Problem& problem, std::size_t object, const std::vector<bool>& immovable);

}  // namespace energymargin::bounds

#pragma once
// The wrench-based baseline, Section V-B (Baseline): engaging, sticking and distance.

#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin {

struct ForceWeights {
  double engage = 1.0;     //!< of the normal force [1/N]
  double stick = 1.0;      //!< of the distance to the friction cone's edge [1/N]
  double distance = 10.0;  //!< taken off per metre between object and effector [1/m]
};

struct ForceScore {
  double force = 0.0;     //!< Omega_force, the weighted sum
  double engage = 0.0;    //!< Omega_engage, sum of the normal forces [N]
  double stick = 0.0;     //!< Omega_stick, sum over the contacts of (mu * normal - |tangential|) cos(atan(mu)) [N]
  double distance = 0.0;  //!< Omega_dist, least distance between object and effector [m]
};

//! Uses the contacts between object and effector that the problem brings, or those simulated at its state.
//! Throws std::invalid_argument on a bad problem, or one whose scene has no effector.
ForceScore force_score(const Problem& problem, const ForceWeights& weights = {});

}  // namespace energymargin

#pragma once
// The wrench-based baseline, Section V-B (Baseline): engaging, sticking and distance.

#include "energymargin/problem.hpp"

namespace energymargin {

//! What the contacts of the object with one kind of body can bear.
struct ContactMargins {
  double engage = 0.0;  //!< Omega_engage, sum of the normal forces [N]
  double stick = 0.0;   //!< Omega_stick, sum over the contacts of (mu * normal - |tangential|) cos(atan(mu)) [N]
};

struct ForceScore {
  double force = 0.0;       //!< Omega_force, the weighted sum
  ContactMargins effector;  //!< over the objects' contacts with all bodies of the effector, such as its fingers
  ContactMargins ground;    //!< over the contacts with all other bodies
  double distance = 0.0;    //!< Omega_dist, least distance to any body of the effector [m]; the objects' mean
};

//! Of the contacts that the problem brings, or those simulated at its state, but those between objects. Throws
//! std::invalid_argument on a problem that is bad or without an effector.
ForceScore force_score(const Problem& problem);

}  // namespace energymargin

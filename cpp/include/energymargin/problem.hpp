#pragma once
// One question: a scene, a start state, the disturbances that may act, and the sets that matter.

#include <optional>
#include <vector>

#include "energymargin/region.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! What the effector does while the object is disturbed.
enum class Effector {
  coast,  ///< it is not actuated: free, as every other body (paper, Section V-A)
  drive,  ///< each edge of the search starts with the velocity that it has in the start state; in between it is free
};

//! The optimal motion planning problem P of Section V-A, with what the scores need besides.
struct Problem {
  Scene scene;
  State state;                        //!< z_init
  Vector3 force = Vector3::Zero();    //!< largest |force| on the object along each axis [N]
  Vector3 torque = Vector3::Zero();   //!< largest |torque| about each axis [N m]
  double duration = 0.5;              //!< longest edge [s]
  Region captured;                    //!< Z_cap(z_init)
  std::optional<Region> succeeded{};  //!< Z_suc
  std::optional<Region> within{};     //!< Z_b: where the search for an escape may go
  Effector effector = Effector::coast;
  double rate = 5.0;                               //!< lambda of eq. 4 [1/J]
  std::optional<std::vector<Contact>> contacts{};  //!< measured at the state, for the force score; unset: simulated
};

//! Throws std::invalid_argument on a bad state, bounds that are negative or not finite, a duration shorter than a step,
//! regions on unknown bodies, no object or more than one, "drive" without an effector, or a start state in which
//! a moving body is deeper in another than a quarter of the smaller one's smallest half extent.
void validate(const Problem& problem);

//! Where an edge from a node with state `node` starts: there or, under Effector::drive, there with the effector at its
//! velocity of the start state.
State edge_start(const Problem& problem, const State& node);

}  // namespace energymargin

#pragma once
// A lower bound of the barrier around a capture set, and the energy that may lift the object over it.

#include <string>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"

namespace energymargin::bounds {

//! The object of a problem whose escape is bounded, and which bodies stay where they are.
struct Subject {
  Subject(const Problem& problem, std::size_t object);

  const Body& body() const { return problem.scene.bodies()[object]; }

  //! Where a body is at the start, and how it moves.
  BodyState at(std::size_t other) const { return kinematics(problem.state.data(), other); }

  const Problem& problem;
  std::size_t object;
  Kinematics kinematics;
  //! By body of the scene: fixed and locked ones, and links rigid on them; with a plan held joints may move.
  std::vector<bool> immovable{};
};

//! The energy that may help an object out without a disturbance.
struct AvailableEnergy {
  double kinetic = 0.0;  //!< of all bodies at the start [J]
  double stored = 0.0;   //!< that all but the object can release: springs, joints, weights [J]; inf: no end of it
  std::string reason{};  //!< why there is no end of it; empty if there is

  double total() const { return kinetic + stored; }
};

AvailableEnergy available_energy(const Subject& subject);

//! How far the search goes.
struct FloodBudget {
  int cells = 0;
  double tolerance = 0.0;  //!< it ends once a way out is known that is no higher than by this share of the barrier
  double enough = 0.0;     //!< a barrier that is known to be no higher is of no use [J]
  Limit limit{};
};

struct BarrierBound {
  double barrier = 0.0;   //!< above the start [J]; inf: there is no way out
  int cells = 0;          //!< that were looked at
  bool complete = false;  //!< it is as tight as was asked for, or there is no way out
  std::string reason{};   //!< why the region bounds nothing; empty if it does
};

//! No way of the object out of `captured` stays below the barrier, wherever else the bodies go that can move. The
//! barrier counts the potential energy, and the kinetic energy with which the object has to come out.
BarrierBound barrier_bound(const Subject& subject, const Region& captured, const FloodBudget& budget);

}  // namespace energymargin::bounds

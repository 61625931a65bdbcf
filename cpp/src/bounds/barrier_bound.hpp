#pragma once
// A lower bound of the barrier around a capture set: the flood of the cells that are not blocked.

#include <string>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"

namespace energymargin::bounds {

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
BarrierBound barrier_bound(const Problem& problem, const Region& captured, std::size_t object,
                           const std::vector<bool>& immovable, const FloodBudget& budget);

}  // namespace energymargin::bounds

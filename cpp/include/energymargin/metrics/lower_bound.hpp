#pragma once
// A lower bound of the effort of escape, from the conservation of energy.

#include <cmath>
#include <string>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

struct LowerBoundOptions {
  int cells = 100'000;                //!< of poses of each object to look at
  double tolerance = 0.05;            //!< the search ends once the barrier is known to this share
  Captured captured = Captured::all;  //!< of several objects, which have to leave
  Limit limit{};                      //!< ends the search early; what is certain so far counts
};

//! Throws std::invalid_argument on less than one cell, or a tolerance that is not above 0.
void validate(const LowerBoundOptions& options);

struct LowerBound {
  double effort = 0.0;    //!< no escape takes less [J]; inf: there is none, a cage
  double barrier = 0.0;   //!< least rise of the object's energy on any way out, or less [J]
  double kinetic = 0.0;   //!< kinetic energy of all bodies at the start [J]
  double stored = 0.0;    //!< energy that other bodies, springs and joints can release [J]; inf: no end of it
  int cells = 0;          //!< of poses that were looked at
  bool complete = false;  //!< the barrier is known to the tolerance, or it is a cage; false: the budget came first
  std::string reason{};   //!< why the effort is bounded by 0 alone; empty if it is bounded by more

  bool cage() const { return std::isinf(effort); }
};

//! The least potential energy over which an object leaves its capture set, minus all energy that may help it. Bodies
//! that can move are in nobody's way; an object that turns freely counts as a ball inside. Fewer cells give less.
LowerBound effort_lower_bound(const Problem& problem, const LowerBoundOptions& options = {});

}  // namespace energymargin

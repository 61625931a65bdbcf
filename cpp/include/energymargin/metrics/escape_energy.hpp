#pragma once
// Escape energy of a quasi-static object, Definitions 1 and 2.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

struct EscapeEnergyOptions {
  std::string planner = "bit*";  //!< "bit*" or "rrt*"
  int samples = 2000;            //!< poses of the object to draw
  std::uint64_t seed = 0;
  std::optional<double> reach{};  //!< half the edge of the box around the start to search in [m]; unset: adapts
  std::string object{};           //!< name of the object that escapes; empty: the only one
  Limit limit{};                  //!< ends the search early; the lowest barrier so far counts
};

struct EscapeEnergy {
  double energy = 0.0;  //!< upper bound of the lowest barrier [J]; inf without an escape, as from a cage
  std::vector<std::pair<int, double>> history;  //!< (samples so far, best energy) at each improvement
  States path;           //!< states at rest from the start to the first one outside (P, n); empty without an escape
  int barrier = -1;      //!< row of the path's highest energy; -1 without an escape
  int samples = 0;       //!< poses drawn
  bool complete = true;  //!< all poses are drawn, or nothing is left to gain
};

//! The least energy above the start's at which an object leaves the capture set slowly: an upper bound that falls.
EscapeEnergy escape_energy(const Problem& problem, const EscapeEnergyOptions& options = {});

}  // namespace energymargin

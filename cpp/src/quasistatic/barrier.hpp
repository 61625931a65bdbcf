#pragma once
// The barrier of a path: where its energy is highest.

#include "quasistatic/landscape.hpp"
#include "quasistatic/path.hpp"

namespace energymargin::quasistatic {

struct Barrier {
  double energy = 0.0;   //!< above that of the start [J]
  std::size_t edge = 0;  //!< from path[edge] to path[edge + 1]
  double at = 0.0;       //!< share of that way, 0..1
};

Barrier barrier(const Path& path, const Landscape& landscape);

}  // namespace energymargin::quasistatic

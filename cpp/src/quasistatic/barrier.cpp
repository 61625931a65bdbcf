#include "quasistatic/barrier.hpp"

namespace energymargin::quasistatic {

Barrier barrier(const Path& path, const Landscape& landscape) {
  Barrier highest;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Landscape::Peak peak = landscape.peak(path[i], path[i + 1]);
    if (peak.energy > highest.energy) highest = {peak.energy, i, peak.at};
  }
  return highest;
}

}  // namespace energymargin::quasistatic

#pragma once
// Words of the metrics' options.

#include "base/words.hpp"
#include "energymargin/metrics/effort.hpp"

namespace energymargin {

inline const std::vector<std::string> effort_planners{"est", "rrt"};
inline const std::vector<std::string> escape_energy_planners{"bit*", "rrt*"};

template <>
struct Words<Search> {
  static constexpr std::pair<const char*, Search> all[]{{"improved", Search::improved},
                                                        {"published", Search::published}};
};

template <>
struct Words<Sampling> {
  static constexpr std::pair<const char*, Sampling> all[]{{"mixed", Sampling::mixed}, {"uniform", Sampling::uniform}};
};

}  // namespace energymargin

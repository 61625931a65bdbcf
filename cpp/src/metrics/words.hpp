#pragma once
// Words of the metrics' options.

#include "base/words.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/problem_io.hpp"

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

template <>
struct Words<Captured> {
  static constexpr std::pair<const char*, Captured> all[]{{"all", Captured::all}, {"any", Captured::any}};
};

template <>
struct Words<Meshes> {
  static constexpr std::pair<const char*, Meshes> all[]{{"embedded", Meshes::embedded}, {"files", Meshes::files}};
};

}  // namespace energymargin

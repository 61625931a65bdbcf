#pragma once
// Makes a way out that a planner found as cheap as it gets nearby. A planner finds which way leads out; how closely it
// passes a rim is a matter of luck, that of a local search is not.

#include "energymargin/limit.hpp"
#include "quasistatic/pose_sampler.hpp"
#include "quasistatic/quasistatics.hpp"

namespace energymargin::search {

//! The highest point of a path.
struct Barrier {
  double energy = 0.0;   //!< [J]
  std::size_t edge = 0;  //!< from path[edge] to path[edge + 1]
  double at = 0.0;       //!< share of that way
};
Barrier barrier(const Path& path, const Quasistatics& statics);

//! The path up to where it leaves the capture set.
Path cut(const Path& path, Quasistatics& statics);

//! A path with the same start and a barrier as low or lower, which ends where it leaves the capture set, and takes no
//! detours that do not pay.
Path relax(const Path& path, Quasistatics& statics, PoseSampler& sampler, int trials, const Limit& limit);

}  // namespace energymargin::search

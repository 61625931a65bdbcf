#pragma once
// Local search for a lower barrier. A planner finds which way leads out; how closely its path passes a rim is luck.

#include "energymargin/limit.hpp"
#include "quasistatic/pose_sampler.hpp"

namespace energymargin::quasistatic {

//! A path with the same start and a barrier as low or lower, which ends where it leaves the capture set, and takes no
//! detours that do not pay.
Path relax(const Path& solution, Landscape& landscape, PoseSampler& sampler, int trials, const Limit& limit);

}  // namespace energymargin::quasistatic

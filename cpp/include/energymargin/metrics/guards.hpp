#pragma once
// When a capture score says less than it seems to.

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

namespace plausible {

// A heavier node than that carries a fifth of all likelihood: the score hangs on where a few rollouts went.
constexpr double resolution = 0.2;
// A capture score above one half says that the object stays.
constexpr double stays = 0.5;
// An object that nothing holds has left a set of half a metre, from rest, in a third of that.
constexpr double foresight = 1.0;  //!< [s]

}  // namespace plausible

//! When a problem without a clock leaves its capture set without a disturbance [s]: looked at every 1/60 s for
//! `plausible::foresight`. None if it stays, or if the limit or a divergence comes first.
std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit = {});

//! Of a capture score: a coarse one, and a high one of an object that leaves by itself.
std::vector<Doubt> implausible(const CaptureScore& score);

//! `capture_score`, and for a score above one half the undisturbed exit.
CaptureScore guarded_capture_score(const Problem& problem, const CaptureOptions& options = {});

}  // namespace energymargin

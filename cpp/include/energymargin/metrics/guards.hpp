#pragma once
// Checks of a capture score: is it fine enough, and does the object stay without a disturbance?

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

namespace plausible {

// A heavier node has a fifth of all likelihood: the score depends on a few rollouts.
constexpr double resolution = 0.2;
// A higher capture score says that the object stays.
constexpr double capture_score = 0.5;
// A free body at rest leaves a set of half a metre in a third of that.
constexpr double foresight = 1.0;  //!< [s]

}  // namespace plausible

//! When a problem without a clock leaves its capture set without a disturbance [s], at looks every 1/60 s for
//! `plausible::foresight`. None if it stays, or if the limit or a divergence comes first.
std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit = {});

//! Doubts about a capture score that is coarse, or high although the object leaves without a disturbance.
std::vector<Doubt> implausible(const CaptureScore& score);

//! `capture_score` and, for a score above `plausible::capture_score`, the undisturbed exit.
CaptureScore guarded_capture_score(const Problem& problem, const CaptureOptions& options = {});

}  // namespace energymargin

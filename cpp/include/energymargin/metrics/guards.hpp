#pragma once
// Checks of results: did the simulation hold, is a score fine enough, does the object stay without a disturbance?

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/probability.hpp"
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
// A hundredth of the steps is about one an impact; a result that depends on more of them depends on the solver.
constexpr double unconverged = 0.01;  //!< share of the steps
constexpr double lost_time = 0.01;    //!< share of the time

}  // namespace plausible

//! When a problem without a clock leaves its capture set without a disturbance [s], at looks every 1/60 s for
//! `plausible::foresight`. None if it stays, or if the limit or a divergence comes first.
std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit = {});

//! Of steps that take `time` together [s]: too many did not converge, or too much of the time is lost.
std::vector<Warning> implausible(const StepCounts& counts, double time);

//! What speaks against a result, its steps among it: a capture score that is coarse, or high although the object leaves
//! without a disturbance; an effort above 0 although it does, or above that of an escape that was discarded. Results
//! have these as their `warnings`.
std::vector<Warning> implausible(const CaptureScore& score, const Problem& problem);
std::vector<Warning> implausible(const Escape& escape, const Problem& problem);
std::vector<Warning> implausible(const CaptureProbability& probability, const Problem& problem);

}  // namespace energymargin

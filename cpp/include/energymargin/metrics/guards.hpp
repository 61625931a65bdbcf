#pragma once
// Checks of results: did the simulation hold, is a score fine enough, does the object stay without a disturbance?

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {

namespace plausible {

constexpr double resolution = 0.2;     //!< a heavier node has a fifth of all likelihood: a few rollouts decide
constexpr double capture_score = 0.5;  //!< a higher one says that the object stays
constexpr double foresight = 1.0;      //!< [s]; a free body at rest leaves a set of half a metre in a third of that
constexpr double unconverged = 0.01;   //!< share of the steps, about one an impact: more depend on the solver
constexpr double lost_time = 0.01;     //!< share of the time

}  // namespace plausible

//! When a problem without a clock leaves its capture set without a disturbance [s], as seen every 1/60 s for
//! `plausible::foresight`. None if it stays, or if the limit or a divergence comes first.
std::optional<double> undisturbed_exit(const Problem& problem, const Limit& limit = {});

//! Whether too many of the steps, which take `time` together [s], did not converge, or too much of the time is lost.
std::vector<Warning> implausible(const StepCounts& counts, double time);

//! Whether more rollouts have diverged than may: one and the share `most`, if others are left; 0: none, 1: any number.
bool too_many_diverged(int diverged, int rollouts, double most);

//! Throws std::runtime_error on too many.
void require_few_diverged(int diverged, int rollouts, double most);

//! The `warnings` of a result: those of its steps; a capture score that is coarse, or high although the object leaves
//! without a disturbance; an effort above 0 although it does, or above that of an escape that was discarded.
std::vector<Warning> implausible(const CaptureScore& score, const Problem& problem);
std::vector<Warning> implausible(const Escape& escape, const Problem& problem);
std::vector<Warning> implausible(const StepCounts& counts, const Problem& problem);

}  // namespace energymargin

#pragma once
// The probability that the objects are lost over a horizon, where that is rare: by adaptive multilevel splitting
// (Brehier et al., Annals of Applied Probability, 2016).

#include <atomic>
#include <functional>
#include <optional>

#include "energymargin/metrics/probability.hpp"

namespace energymargin {

struct RareOptions {
  DisturbanceModel disturbance = disturbances::Uniform{};  //!< Uniform, Gaussian or ActuationNoise
  int rollouts = 1000;                                     //!< replicas, in batches whose estimates are independent
  std::uint64_t seed = 0;
  int threads = 1;  //!< for batches; the probability does not depend on it
  //! How near to its loss a state is, where replicas split. Unset: a forecast of SignedDistance of the capture set.
  std::function<double(const State&)> level{};
  //! The level counts what it gains in so long at its rate of now [s]; unset, with `level`: while a rate is remembered.
  std::optional<double> ahead{};
  Limit limit{};  //!< ends it early: the batches that are complete count, up to the first that is not
  std::atomic<int>* rollout_counter = nullptr;  //!< goes up with each rollout, for a bar of progress
};

//! The batches, and the fewest replicas.
inline constexpr int splitting_batches = 10;
inline constexpr int fewest_replicas = 4 * splitting_batches;

//! The probability of all objects. A rollout that diverges counts as captured from there on. Throws as
//! capture_probability does, and std::invalid_argument on a disturbance that cannot branch or a capture set without a
//! distance; Cancelled or TimedOut if the limit is reached before four batches are complete.
CaptureProbability rare_capture_probability(const Problem& problem, const RareOptions& options = {});

}  // namespace energymargin

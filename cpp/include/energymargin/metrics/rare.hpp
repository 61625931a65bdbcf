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
  //! How near to its loss a state is: replicas split where it rises. Unset: a linear forecast of SignedDistance of the
  //! capture set, in standard deviations of its error, which a few replicas find first. The probability is unbiased
  //! with any level; its interval is narrow with a good one.
  std::function<double(const State&)> level{};
  //! Set: the level is `level`, or SignedDistance, and what it gains in so long at its rate of now [s], without a
  //! forecast. Unset with a level of the caller's: as long as a rate is remembered, which rollouts of their own tell.
  std::optional<double> ahead{};
  Limit limit{};  //!< ends it early: the batches that are complete count, up to the first that is not
  std::atomic<int>* rollout_counter = nullptr;  //!< goes up with each rollout, for a bar of progress
};

//! The batches, and the fewest replicas.
inline constexpr int splitting_batches = 10;
inline constexpr int fewest_replicas = 4 * splitting_batches;

//! Of all objects. A rollout that diverges counts as captured from there on. Throws std::invalid_argument on a problem
//! without horizon and plan, on bad options, a disturbance that cannot branch, or a capture set that has no distance;
//! std::runtime_error if more than 1 % of the rollouts diverge; Cancelled or TimedOut if the limit is reached before
//! four batches are complete.
CaptureProbability rare_capture_probability(const Problem& problem, const RareOptions& options = {});

}  // namespace energymargin

#pragma once
// The probability that the objects stay captured over a horizon, under a stated random disturbance.

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "energymargin/disturbances.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/metrics/interval.hpp"

namespace energymargin {

//! With a tolerance: rollouts at the first look, twice as many at each next one, and most, unless given.
inline constexpr int first_look = 32;
inline constexpr int most_rollouts = 10000;

struct ProbabilityOptions {
  DisturbanceModel disturbance = disturbances::Uniform{};
  std::optional<int> rollouts{};  //!< unset: 30, or `most_rollouts` if there is a tolerance
  std::uint64_t seed = 0;
  int threads = 1;                    //!< the probability does not depend on it
  std::optional<double> tolerance{};  //!< rollouts are added until half of the 95 % interval is at most this
  bool success = false;               //!< also of the success set at the horizon: rollouts run on after an exit
  bool by_object = false;             //!< also of any object, and of each: rollouts run on until all have left
  Limit limit{};  //!< ends it early: the rollouts that are complete count, up to the first that is not
  std::atomic<int>* made = nullptr;  //!< goes up with each rollout; null: not counted
};

//! How one set fares.
struct Survival {
  Eigen::VectorXd curve;   //!< probability of having been captured throughout until each time, shape (T,)
  double mean_time = 0.0;  //!< mean time captured within the horizon [s]: restricted mean survival time

  double captured() const { return curve[curve.size() - 1]; }
};

struct CaptureProbability {
  Eigen::VectorXd times;  //!< at which the sets are looked at, from 0 to the horizon, shape (T,) [s]
  Survival all;           //!< of all objects
  std::optional<Survival> any{};
  std::vector<Survival> by_object{};  //!< in the scene's order
  std::optional<double> success{};    //!< probability of being in the success set at the horizon
  bool undisturbed = true;            //!< whether they stay captured without a disturbance
  double undisturbed_time = 0.0;      //!< until when [s]; the horizon if they do
  std::optional<bool> undisturbed_success{};
  int rollouts = 0;        //!< random ones that count
  long long steps = 0;     //!< simulation steps, of the undisturbed one too
  int diverged = 0;        //!< rollouts that are left out
  double effective = 0.0;  //!< as many rollouts of equal weight say as much
  int looks = 1;           //!< at the tolerance that there may be: intervals are as much wider
  bool complete = true;
};

//! Throws std::invalid_argument on a problem without horizon and plan, and on bad options; std::runtime_error if more
//! than 1 % of the rollouts diverge; Cancelled or TimedOut if the limit is reached before the first one is complete.
CaptureProbability capture_probability(const Problem& problem, const ProbabilityOptions& options = {});

//! Clopper and Pearson's interval of a probability that was estimated from `effective` rollouts.
Interval interval(double probability, double effective, double confidence = 0.95);

}  // namespace energymargin

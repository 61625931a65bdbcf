#pragma once
// The probability that the objects stay captured over a horizon, under a stated random disturbance.

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "energymargin/disturbances.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! A tolerance is checked at so many rollouts first, and then at twice as many each time; and the most by default.
inline constexpr int first_look = 32;
inline constexpr int most_rollouts = 10000;

//! Of a threshold: it is asked at so many rollouts first, and then at a quarter more each time; the most by default,
//! and the probability of each of both wrong answers.
inline constexpr int first_decision = 8;
inline constexpr int most_of_decision = 300;
inline constexpr double error_of_decision = 0.05;

//! How rollouts are drawn: one apart from the other, or evenly spread over the first 256 of their random numbers,
//! by randomized quasi-Monte Carlo. Both are unbiased.
enum class Design { independent, sobol };

struct ProbabilityOptions {
  DisturbanceModel disturbance = disturbances::Uniform{};
  std::optional<int> rollouts{};  //!< unset: 30, or `most_rollouts` with a tolerance, `most_of_decision` with `above`
  std::uint64_t seed = 0;
  std::uint64_t first = 0;            //!< number of the first rollout: a part of them has the bits of the whole
  int threads = 1;                    //!< the probability does not depend on it
  std::optional<double> tolerance{};  //!< rollouts are added until half of the 95 % interval is at most this
  std::optional<double> above{};      //!< rollouts are added until it is told whether the probability is above this
  Design design = Design::independent;
  std::optional<double> drawn_step{};  //!< disturbances are drawn in steps of this length [s], by default the scene's:
                                       //!< in problems that differ in their step the same draws act
  std::optional<double> long_step{};   //!< rollouts take this longer step [s], and some of them the scene's too
  bool finds_step = false;             //!< the same with a step that is found, if that needs less simulation
  bool success = false;                //!< also for the success set at the horizon: rollouts go on after an exit
  bool by_object = false;              //!< also for any object, and for each: rollouts go on until all have left
  bool undisturbed = true;             //!< also one rollout without a disturbance, before the random ones
  double most_diverged = 0.01;         //!< share of the rollouts that may diverge, and one always, if others are left
                                       //!< and it is not 0; 1: any number, and if none is left the probability is NaN
  Limit limit{};  //!< ends it early: the rollouts that are complete count, up to the first that is not
  std::atomic<int>* rollout_counter = nullptr;  //!< goes up with each rollout, for a bar of progress
};

//! The survival curve of one set.
struct Survival {
  Eigen::VectorXd curve;   //!< probability of being captured throughout until each time, shape (T,)
  double mean_time = 0.0;  //!< mean time captured within the horizon [s]: restricted mean survival time

  double captured() const { return curve[curve.size() - 1]; }
};

//! How adaptive multilevel splitting got there.
struct Splitting {
  Eigen::VectorXd effective;  //!< effective sample size of the loss until each time, shape (T,)
  double levels = 0.0;        //!< at which replicas split, in the mean of the batches
  int simulated = 0;          //!< rollouts that were simulated: the replicas, and those that branch from them
};

//! A multilevel estimate: the mean of rollouts with a long step, and of what those that took the scene's step too
//! differ by. Unbiased for the scene's step (Giles 2015).
struct TwoSteps {
  double step = 0.0;              //!< the long one [s]
  int rollouts = 0;               //!< that took it, and count
  int pairs = 0;                  //!< of them, with both steps
  Eigen::VectorXd captured;       //!< probability with the long step until each time, shape (T,)
  Eigen::VectorXd better, worse;  //!< pairs that are captured until then with the scene's step alone, or the long one
};

//! Its steps are those of all rollouts, also the undisturbed one, but for those that diverged.
struct CaptureProbability : StepCounts {
  Eigen::VectorXd times;  //!< at which the sets are checked, from 0 to the horizon, shape (T,) [s]
  Survival all;           //!< of all objects
  Eigen::VectorXd lost;   //!< probability of having been lost until each time, 1 - all.curve in full precision
  std::optional<Survival> any{};
  std::vector<std::pair<std::string, Survival>> by_object{};  //!< each object with its name, in the scene's order
  std::optional<double> success{};  //!< probability of being in the success set at the horizon
  bool undisturbed = true;          //!< whether the objects stay captured without a disturbance, if that was asked
  double undisturbed_time = 0.0;    //!< when they leave without one [s]; the horizon if they stay, NaN if not asked
  std::optional<bool> undisturbed_success{};
  Eigen::VectorXd exit_times;  //!< when each rollout leaves [s]: inf if it stays, NaN if it diverged; not of splitting
  std::vector<char> successes{};    //!< whether each ends in the success set, if that was asked
  int rollouts = 0;                 //!< random rollouts that count; of splitting the replicas
  int diverged = 0;                 //!< rollouts that diverged, and do not count
  double effective = 0.0;           //!< effective sample size: rollouts of equal weight that say as much
  double effective_of_parts = 0.0;  //!< the same of any, of each, of successes, and until earlier times
  int looks = 1;  //!< the most looks at a tolerance or a threshold; intervals are wider by them (Bonferroni)
  std::optional<bool> above{};           //!< whether it is above `ProbabilityOptions::above`, if that was told
  bool complete = true;                  //!< no rollout is missing
  std::optional<Splitting> splitting{};  //!< of rare losses
  std::optional<TwoSteps> two_steps{};   //!< with a long step
  std::vector<Warning> warnings{};       //!< what speaks against the probability
};

//! Throws std::invalid_argument on a problem without horizon and plan, and on bad options; std::runtime_error if too
//! many rollouts diverge; Cancelled or TimedOut if the limit is reached before the first one is complete.
CaptureProbability capture_probability(const Problem& problem, const ProbabilityOptions& options = {});

//! The same with a long step.
CaptureProbability capture_probability_of_two_steps(const Problem& problem, const ProbabilityOptions& options);

//! Whether a probability is above a threshold, of which `captured` of `rollouts` say something; none: it is not told. A
//! probability at most the threshold is ever called above, after any number of independent rollouts, with probability
//! `error` at most, and one at least the threshold as seldom called not above: Ville's inequality for the likelihoods
//! of all probabilities beyond it, evenly weighed (Robbins, Annals of Mathematical Statistics, 1970).
std::optional<bool> is_above(double threshold, int captured, int rollouts, double error = error_of_decision);

//! Clopper and Pearson's interval of a probability that `effective` rollouts estimate.
Interval interval(double probability, double effective, double confidence = 0.95);

//! That of two steps, by those of both of its parts (Zou and Donner 2008).
Interval interval(const TwoSteps& of, Eigen::Index time, double confidence = 0.95);

//! The same of being captured throughout until time number `time`, and of the loss; by default until the horizon.
Interval interval_of_capture(const CaptureProbability& p, double confidence = 0.95,
                             std::optional<Eigen::Index> time = std::nullopt);
Interval interval_of_loss(const CaptureProbability& p, double confidence = 0.95,
                          std::optional<Eigen::Index> time = std::nullopt);

}  // namespace energymargin

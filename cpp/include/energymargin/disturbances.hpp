#pragma once
// Models of the random disturbances that act on the objects, and draws of pushes from them.

#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"

namespace energymargin {
namespace disturbances {

//! Piecewise constant. Each piece is uniform within `strength` times the problem's bounds, along and about each axis,
//! and lasts for a uniform time of at least a step and at most `hold`.
struct Uniform {
  double strength = 1.0;         //!< of the bounds
  std::optional<int> objects{};  //!< how many each piece acts on, drawn for each piece; unset: all
  std::optional<double> hold{};  //!< longest piece [s]; unset: the problem's duration
};

//! Normal in each step, on the axes whose bounds are not 0. The correlation decays as exp(-t / correlation_time).
struct Gaussian {
  double force = 0.0;             //!< standard deviation along each axis [N]
  double torque = 0.0;            //!< about each axis [N m]
  double correlation_time = 0.1;  //!< [s]
};

//! Uniform, with each rollout weighted by exp(-rate * effort): importance sampling.
struct Boltzmann {
  double rate = 0.0;  //!< [1/J]
  Uniform proposal{};
};

//! Noise of the robot: a uniform draw is added to its plan, and lasts for `hold`.
struct ActuationNoise {
  Vector3 force = Vector3::Zero();   //!< largest, on each body that the plan pushes or drives [N]
  Vector3 torque = Vector3::Zero();  //!< the same [N m]
  double targets = 0.0;              //!< largest error of each joint's target [rad] or [m]
  std::optional<double> hold{};      //!< [s]; unset: a step
};

//! A user's own model.
struct Draws {
  //! The wrenches of the steps of rollout number `index`, shape (steps, 6 k); none if the limit was reached before. One
  //! thread at a time asks, in the order of the numbers.
  std::function<std::optional<Wrenches>(std::uint64_t index, const Limit& limit)> wrenches;
};

}  // namespace disturbances

using DisturbanceModel = std::variant<disturbances::Uniform, disturbances::Gaussian, disturbances::Boltzmann,
                                      disturbances::ActuationNoise, disturbances::Draws>;

//! Throws std::invalid_argument on bad numbers, too many objects, or noise without a plan.
void validate(const DisturbanceModel& model, const Problem& problem);

//! What acts in one rollout.
struct Draw {
  std::vector<Push> pushes{};
  std::optional<Plan> plan{};  //!< of ActuationNoise: the problem's plan with its noise
  NoiseSeeds noise{};          //!< of what the problem's robot observes
};

//! Draw number `index`, of `steps` steps, from a valid model but Draws. A draw with a parent, of the same model but
//! Boltzmann, is like it for `step` steps and goes on as the model says: how long a piece of Uniform lasts is new.
//! `leading` are its first random numbers, uniform in [0, 1); the others are those of the seed.
Draw draw(const DisturbanceModel& model, const Problem& problem, int steps, std::uint64_t seed, std::size_t index,
          const Draw& parent = {}, int step = 0, std::vector<double> leading = {});

//! The same draw in steps of another length [s], `steps` of them: each has the mean wrench of its time.
Draw resampled(Draw draw, double from, double to, int steps);

//! The same of a user's model; none if the limit was reached before. Throws std::invalid_argument on another shape and
//! on numbers that are not finite.
std::optional<Draw> draw(const disturbances::Draws& model, const Problem& problem, int steps, std::uint64_t seed,
                         std::size_t index, const Limit& limit);

}  // namespace energymargin

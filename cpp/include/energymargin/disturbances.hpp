#pragma once
// What may act on the objects at random: stated models of a disturbance, and pushes drawn from them.

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin {
namespace disturbances {

//! Piecewise constant: along and about each axis even within `strength` times the problem's bounds, held for an even
//! draw of time up to the problem's duration, and at least a step.
struct Uniform {
  double strength = 1.0;         //!< of the bounds
  std::optional<int> objects{};  //!< that each piece meets, drawn anew for each; unset: all
  std::optional<double> hold{};  //!< longest piece [s]; unset: the problem's duration
};

//! Of each step anew and normal, with a correlation in time that fades as exp(-t / correlation_time). Its axes are
//! those of the problem's bounds that are not 0.
struct Gaussian {
  double force = 0.0;             //!< standard deviation along each axis [N]
  double torque = 0.0;            //!< about each axis [N m]
  double correlation_time = 0.1;  //!< [s]
};

//! Uniform, with each rollout weighted by exp(-rate * effort), by importance.
struct Boltzmann {
  double rate = 0.0;  //!< [1/J]
  Uniform proposal{};
};

//! Of the robot itself: to what its plan says an even draw is added, held for `hold`.
struct OfPlan {
  Vector3 force = Vector3::Zero();   //!< largest, on each body of the plan's wrenches and motors [N]
  Vector3 torque = Vector3::Zero();  //!< the same [N m]
  double targets = 0.0;              //!< largest, of each joint's target [rad] or [m]
  std::optional<double> hold{};      //!< [s]; unset: a step
};

//! Given for each rollout: wrenches of each step, shape (steps, 6 k).
struct Given {
  std::vector<Wrenches> rollouts;
};

}  // namespace disturbances

using DisturbanceModel = std::variant<disturbances::Uniform, disturbances::Gaussian, disturbances::Boltzmann,
                                      disturbances::OfPlan, disturbances::Given>;

//! Throws std::invalid_argument on numbers that are negative or not finite, more objects than there are, noise of a
//! plan without one, or given wrenches of another shape.
void validate(const DisturbanceModel& model, const Problem& problem);

//! What acts in one rollout of `steps` steps, as number `index` of a seed's. The model is valid.
std::vector<Push> draw_pushes(const DisturbanceModel& model, const Problem& problem, int steps, std::uint64_t seed,
                              std::size_t index);

//! The problem's plan with the noise of the same draw; none unless the model is OfPlan.
std::optional<Plan> draw_plan(const DisturbanceModel& model, const Problem& problem, std::uint64_t seed,
                              std::size_t index);

}  // namespace energymargin

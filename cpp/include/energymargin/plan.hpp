#pragma once
// What a robot does over time.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "energymargin/feedback.hpp"
#include "energymargin/policy.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

//! Longest rollout [steps].
inline constexpr int most_steps = 1000000;

//! Wrenches on one body, shape (K, 6) [N, N m], in the world's axes, at its centre of mass.
struct Drive {
  std::string body;
  Wrenches wrenches;
};

//! Target positions of one joint under position control, shape (K,) [rad] or [m].
struct Targets {
  std::string joint;
  Eigen::VectorXd positions;
};

//! Velocities of a free body's frame, which a motor keeps, shape (K, 6) [m/s, rad/s]. A kinematic body has no limits.
struct Servo {
  std::string body;
  Wrenches velocities;
  std::optional<double> force{};   //!< largest, along each axis [N]; unset: by `with_default_limits`
  std::optional<double> torque{};  //!< largest, about each axis [N m]; unset: the same
};

//! What a robot does from a problem's state on: rows in time, each held for `step`.
struct Plan {
  double step = 0.0;  //!< of a row [s]; at least a step of the scene
  std::vector<Drive> wrenches{};
  std::vector<Targets> targets{};
  std::vector<Servo> velocities{};
  std::optional<Feedback> feedback{};  //!< with it the last row stays

  //! What the feedback corrects it commands instead, at the feedback's control times.
  std::shared_ptr<const Policy> policy{};

  //! K, 0 if it does nothing.
  int rows() const;

  double duration() const { return rows() * step; }
};

//! Throws std::invalid_argument on bad rows or steps, and what no plan can act on. Errors call the wrenches `wrenches`.
void validate(const Plan& plan, const Scene& scene, const std::string& wrenches = "wrenches");

//! As much of it as can be said without a scene.
void validate(const Plan& plan, const std::string& wrenches = "wrenches");

//! Limits that are unset become twice what holds a body and its links [N], and that at its radius [N m].
Servo with_default_limits(const Scene& scene, Servo servo);

//! A plan and its corrections: where a wrench or a velocity is corrected, and the plan has none, rows of zeros are
//! added. Throws std::invalid_argument.
Plan with_feedback(Plan plan, Feedback feedback);

//! The same plan with a row for each step [s] of a scene: each row begins at the step that is nearest to its time.
Plan fine_rows(const Plan& plan, double step);

//! The same plan with a row for each step [s] of a scene, which is longer than the plan's: the means of the wrenches
//! and velocities in it, and the last targets.
Plan coarse_rows(const Plan& plan, double step);

//! What is left of a plan after `done` steps [s] of a scene, and of its feedback, which remembers `memory` then. Rows
//! stay as they are where one begins there, and otherwise have the scene's step. Throws std::invalid_argument if
//! nothing is.
Plan rest_of(const Plan& plan, int done, double step, const Eigen::VectorXd& memory = {});

//! The robot goes on as it moves at a state: free effectors, or the roots of others, keep their twist in their own
//! frames, joints their targets. Rows have the scene's step; `duration` [s] is rounded to whole ones.
Plan hold(const Scene& scene, const State& state, double duration);

}  // namespace energymargin

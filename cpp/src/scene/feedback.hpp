#pragma once
// What the names of a Feedback mean in a scene.

#include <string>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/plan.hpp"

namespace energymargin {

//! A number that a controller observes.
struct Observed {
  enum class Kind { position, rate, pose, velocity, force };
  Kind kind;
  std::size_t index;      // of a joint, or of a body
  std::size_t other = 0;  // of the second body of a force
  int axis = 0;           // of a pose or a velocity: 0 to 5
};

//! Throws std::invalid_argument, in the name of `observed`, if the scene has no such number.
Observed observed(const Scene& scene, const std::string& name);

//! Reads numbers from states: those of some names, but for forces, or all.
class Observer {
 public:
  //! No names: all numbers of a state, and behind them a simulator's memory. Throws std::invalid_argument.
  Observer(const Scene& scene, const std::vector<std::string>& names);

  Eigen::Index size() const { return names_.empty() ? all_ : static_cast<Eigen::Index>(names_.size()); }

  //! Those of a state.
  Eigen::RowVectorXd operator()(const State& state) const;

  //! One of a state; no force.
  double operator()(const State& state, const Observed& of) const;

 private:
  StateLayout layout_;
  Kinematics kinematics_;
  std::vector<Observed> names_;
  Eigen::Index all_;
};

//! A number of a plan's rows.
struct Corrected {
  enum class Kind { target, wrench, velocity };
  Kind kind;
  std::string of;  // a joint, a tendon or a body
  int axis = 0;
};

//! What the name of a corrected number says, whatever the scene.
Corrected corrected(const std::string& name);

//! How many numbers a robot remembers: whether it has begun, what acts and is to act, and forces or its own.
Eigen::Index memory_size(const Feedback& feedback, const Policy* policy);

//! What a policy commands before it has answered: joints keep the scene's targets, the rest is zero.
Eigen::VectorXd first_commands(const Scene& scene, const Feedback& feedback);

//! Throws std::invalid_argument on numbers of the wrong shape, and on what the plan has no rows of.
void validate(const Feedback& feedback, const Plan& plan);

}  // namespace energymargin

#pragma once
// The mechanical energy of a scene.

#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/shape.hpp"

namespace energymargin {

//! Of a joint's compliance, zero at its target [J].
double compliance_energy(const PositionControl& control, double position);

//! E of eq. 3: kinetic energy of all bodies that forces move, links included; potential energy of gravity and of the
//! constant forces, with its zero at the world's origin; of the springs; and of the joints' compliance, zero at their
//! targets.
class Energy {
 public:
  explicit Energy(const Scene& scene);

  //! [J]; the state is taken as valid.
  double operator()(const State& state) const;

  //! The kinetic part of it, as a frame sees it that moves with the velocities of `frame`, body by body [J].
  double kinetic(State state, const State& frame) const;

  //! Power of gravity, the constant forces and the springs' stiffness on the bodies: how fast their potential energy
  //! falls [W].
  double power(const State& state) const;

 private:
  double of_body(std::size_t body, const BodyState& frame) const;
  double of_spring(const Spring& spring, const State& state) const;
  double power_of(const Spring& spring, const State& state) const;

  Scene scene_;
  StateLayout layout_;
  Kinematics kinematics_;
  std::vector<Eigen::Index> velocities_;  // where they are in a state
};

}  // namespace energymargin

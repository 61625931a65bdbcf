#pragma once
// Where the energy of a rollout went.

#include <cmath>

namespace energymargin {

//! The balance of one rollout. Each work [J] is that on the bodies: positive where it gives them energy. An impulse
//! works along the mean of the velocities before the step and after it, which makes the sum over all impulses the gain
//! of kinetic energy.
struct Audit {
  double energy_change = 0.0;  //!< mechanical energy, World::energy, at the end minus at the start [J]
  double wrench = 0.0;         //!< of the disturbance: Rollout::work [J]
  double plan =
      0.0;  //!< of the robot's plan: its wrenches, its servos, targets that it moves, and kinematic bodies [J]
  double friction = 0.0;  //!< of friction at contacts; negative but for solver error [J]
  //! Of the normal impulses at contacts: the loss of impacts, negative. Positive where links that overlap something are
  //! pushed out of it, which Bullet does by a change of velocity [J].
  double contacts = 0.0;
  //! Of joint stops, negative where a joint hits one, and of what keeps mimic joints together [J].
  double joints = 0.0;
  double damping = 0.0;  //!< of the damping of joints and springs; negative [J]
  double drives = 0.0;   //!< of drives to a target velocity: damping * target velocity, within the torque limit [J]
  //! Of penetration recovery (split impulses) against gravity, constant forces and springs; it takes no impulse [J].
  double overlap = 0.0;
  //! What the steps of the simulation are known to change, of the order of their length h: velocities are h / 2 behind
  //! the positions, which counts the power P of gravity, constant forces and springs as -h / 2 (P at the end - P at the
  //! start); and compliant joints, integrated implicitly, are damped as by stiffness * h [J].
  double integration = 0.0;

  //! What the entries leave open: energy_change minus all of them. It is the error of the simulation that has no name,
  //! most of it that of turning in steps [J].
  double leftover() const {
    return energy_change - (wrench + plan + friction + contacts + joints + damping + drives + overlap + integration);
  }

  //! Energy turned over: the sum of the absolute values of energy_change and all the entries. What `leftover` is to be
  //! compared with [J].
  double turnover() const {
    return std::abs(energy_change) + std::abs(wrench) + std::abs(plan) + std::abs(friction) + std::abs(contacts) +
           std::abs(joints) + std::abs(damping) + std::abs(drives) + std::abs(overlap) + std::abs(integration);
  }
};

}  // namespace energymargin

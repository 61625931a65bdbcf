#pragma once
// Where the energy of a rollout went.

#include <cmath>

namespace energymargin {

//! The balance of one rollout. Each work [J] is positive where it gives the bodies energy. An impulse works along the
//! mean of the velocities before and after the step. `audit_entries` says what each entry is.
struct Audit {
  double energy_change = 0.0;  //!< mechanical energy, World::energy, at the end minus at the start [J]
  double wrench = 0.0, plan = 0.0, friction = 0.0, contacts = 0.0, joints = 0.0, damping = 0.0, drives = 0.0,
         overlap = 0.0, integration = 0.0;

  //! energy_change minus all entries, mostly the error of finite rotations [J].
  double leftover() const;

  //! Sum of the absolute values of energy_change and all entries: the scale of `leftover` [J].
  double turnover() const;
};

//! An entry of the balance.
struct AuditEntry {
  const char* name;
  double Audit::* work;
  const char* description;
};

inline constexpr AuditEntry audit_entries[] = {
    {"wrench", &Audit::wrench, "Work of the disturbance: Rollout.work [J]."},
    {"plan", &Audit::plan,
     "Work of the robot's plan: its wrenches, its servos, targets that differ from the scene's, and kinematic bodies "
     "[J]."},
    {"friction", &Audit::friction, "Work of friction at contacts; negative but for solver error [J]."},
    {"contacts", &Audit::contacts,
     "Work of the normal impulses at contacts [J]. Impacts lose energy: negative. Positive where what overlaps is "
     "parted."},
    {"joints", &Audit::joints,
     "Work of joint stops, negative where a joint hits one, of dry friction of joints, and of the coupling of mimic "
     "joints [J]."},
    {"damping", &Audit::damping, "Work of the damping of joints and springs; negative [J]."},
    {"drives", &Audit::drives,
     "Work of drives to a target velocity: damping * target velocity, within the torque limit [J]."},
    {"overlap", &Audit::overlap,
     "Work of penetration recovery (split impulses) against gravity, constant forces and springs; it takes no impulse "
     "[J]."},
    {"integration", &Audit::integration,
     "Known error of time integration, of the order of the step h [J]. Velocities are h / 2 behind the positions, "
     "which counts the power P of gravity, constant forces and springs as -h / 2 (P at the end - P at the start). "
     "Implicit integration damps compliant joints as stiffness * h does."}};

inline double Audit::leftover() const {
  double works = 0.0;
  for (const AuditEntry& entry : audit_entries) works += this->*entry.work;
  return energy_change - works;
}

inline double Audit::turnover() const {
  double sum = std::abs(energy_change);
  for (const AuditEntry& entry : audit_entries) sum += std::abs(this->*entry.work);
  return sum;
}

}  // namespace energymargin

#pragma once
// The balance of energy of a rollout, substep by substep.

#include <vector>

#include "physics/simulation.hpp"
#include "scene/energy.hpp"

namespace energymargin {

//! Watches a simulation from where it is when this is made, to the end of its own life.
class Auditor {
 public:
  Auditor(Simulation& simulation, const Energy& energy);
  ~Auditor();
  Auditor(const Auditor&) = delete;
  Auditor& operator=(const Auditor&) = delete;

  //! To be called before anything acts in a substep, and when that is over.
  void begin();
  void end(const SubstepResult& substep);

  //! The balance of the substeps so far; without energy_change and wrench, which others know.
  Audit audit() const;

 private:
  void add_actuations(double duration);
  void add_control(std::size_t index, const JointState& before, const JointState& after, double duration);

  Simulation& simulation_;
  const Energy& energy_;

  Motion before_;
  std::vector<Velocity> velocities_, next_velocities_;  // of all bodies, where the robot pushes some
  std::vector<Load> held_;                              // of springs on kinematic bodies that carry no links
  State state_;                                         // before the substep
  State next_;                                          // after it
  std::vector<double> length_rates_;                    // of the springs, before the substep
  std::vector<std::size_t> controlled_;                 // joints and tendons with a stiffness or a damping
  Audit audit_;
};

}  // namespace energymargin

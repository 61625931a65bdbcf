#pragma once
// The balance of energy of a rollout, step by step.

#include <vector>

#include "energymargin/audit.hpp"
#include "simulation.hpp"

namespace energymargin {

//! Watches a simulation from where it is when this is made, to the end of its own life.
class Auditor {
 public:
  explicit Auditor(Simulation& simulation);
  ~Auditor();
  Auditor(const Auditor&) = delete;
  Auditor& operator=(const Auditor&) = delete;

  //! Before anything acts in a step, and when the step is over.
  void begin_step();
  void end_step();

  //! Of the steps so far; without energy_change and wrench, which others know.
  Audit audit() const;

 private:
  void add_control(const Joint& joint, const JointState& before, const JointState& after);
  void add_damper(const Spring& spring, double growth_before, double growth_after);

  Simulation& simulation_;
  Motion before_;
  State state_;                          // before the step
  State next_;                           // after it
  std::vector<double> growths_;          // of the springs, before the step
  std::vector<std::size_t> controlled_;  // joints with a stiffness or a damping
  Audit audit_;
};

}  // namespace energymargin

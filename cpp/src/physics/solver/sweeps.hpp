#pragma once
// Sequential impulses: slow to converge, but sure to find out what opens, sticks and slides.

#include <cstddef>
#include <vector>

#include "physics/solver/velocity_system.hpp"

namespace energymargin {

//! Projected Gauss-Seidel: row by row lambda becomes lambda + (miss - R lambda) / (J A^-1 J' + R), cut to its cone or
//! limits, and v follows by A^-1 J' times the change.
class Sweeps {
 public:
  //! The system outlives this.
  explicit Sweeps(VelocitySystem& system) : system_(system) {}

  //! Starts anew, with no impulses.
  void start(const Island& island);

  //! So many times from one contact to the next, and every other time backwards.
  void run(const Island& island, int sweeps);

  //! The velocities that belong to what the rows have as their swept impulses.
  const std::vector<double>& velocities() const { return velocities_; }

 private:
  void invert(int mover);
  void answer(RowSides& sides, int rows, double* inverse_masses);
  void push(const RowSides& sides, int row, double impulse);
  void resolve(ContactRows& rows);
  void resolve(LimitedRow& row);

  VelocitySystem& system_;
  std::vector<double> answers_, inverses_, velocities_;
};

}  // namespace energymargin

#pragma once
// Sequential impulses: slow to converge, but sure to find out what opens, sticks and slides.

#include <cstddef>
#include <vector>

#include "physics/solver/islands.hpp"

namespace energymargin {

//! Projected Gauss-Seidel: row by row lambda becomes lambda + (miss - R lambda) / (J A^-1 J' + R), cut to its cone or
//! limits, and v follows by A^-1 J' times the change.
class Sweeps {
 public:
  //! The system outlives this.
  explicit Sweeps(const VelocitySystem& system) : system_(system) {}

  //! Starts anew, with no impulses.
  void start(const Island& island);

  //! So many times from one contact to the next, and every other time backwards.
  void run(const Island& island, int sweeps);

  //! What it is at: velocities and impulses that belong together.
  const std::vector<double>& velocities() const { return velocities_; }
  const ContactVector& impulse(std::size_t contact) const { return contacts_[contact].impulse; }
  double limited_impulse(std::size_t row) const { return limited_[row].impulse; }
  double limited_inverse_mass(std::size_t row) const { return limited_[row].inverse_mass; }

 private:
  struct Swept {  // a contact's impulse, and how velocities answer to one along its rows: where that is in `answers_`
    ContactVector impulse{};
    ContactVector inverse_masses{};
    std::size_t of_a = 0, of_b = 0;
  };
  struct SweptRow {
    double impulse = 0.0, inverse_mass = 0.0;
    std::size_t of_a = 0, of_b = 0;
  };

  void invert(int mover);
  std::size_t answer(int mover, std::size_t begin, int rows, double* inverse_masses);
  void push(const RowSides& sides, int row, std::size_t of_a, std::size_t of_b, double impulse);
  void resolve_contact(std::size_t k);
  void resolve_limited(std::size_t k);

  const VelocitySystem& system_;
  std::vector<Swept> contacts_;
  std::vector<SweptRow> limited_;
  std::vector<double> answers_, inverses_, velocities_;
};

}  // namespace energymargin

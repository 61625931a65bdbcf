#pragma once
// Movers that rows connect.

#include <cstddef>
#include <vector>

#include "physics/solver/velocity_system.hpp"

namespace energymargin {

//! Movers, contacts and limited rows by their places in the system.
struct Island {
  std::vector<int> movers;
  std::vector<std::size_t> contacts, limited;
  std::vector<int> first;  //!< column of each row of its matrix that is not zero

  //! Whether nothing acts on it but its loads.
  bool free() const { return contacts.empty() && limited.empty(); }
};

//! The islands of a system; each has equations of its own.
class Islands {
 public:
  void find(const VelocitySystem& system);

  std::size_t count() const { return count_; }
  const Island& operator[](std::size_t i) const { return islands_[i]; }

  //! The first row of a mover in its island's matrix.
  int row(int mover) const { return rows_[static_cast<std::size_t>(mover)]; }

 private:
  int root(int mover);
  void join(const RowSides& sides);
  void order(const VelocitySystem& system, Island& island);
  void order_by_neighbours(const VelocitySystem& system, Island& island) const;

  std::vector<Island> islands_;  // more than `count_` may be there
  std::size_t count_ = 0;
  std::vector<int> parents_, places_, rows_;  // of each mover
};

}  // namespace energymargin

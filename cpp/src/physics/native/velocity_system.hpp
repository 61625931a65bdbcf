#pragma once
// Velocities with an inertia, the rows of contacts and limits over them, and the islands of movers that rows connect.

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "physics/native/friction_law.hpp"

namespace energymargin {

//! Some of all velocities, and what acts on them: `a` and `b` are movers, -1: none. Jacobians are in the solver's
//! numbers, row by row, as many columns as the mover has velocities.
struct RowSides {
  int a = -1, b = -1;
  std::size_t of_a = 0, of_b = 0;
};

//! A contact point: as many rows as its law has.
struct ContactRows : RowSides {
  FrictionLaw law;
  ContactVector target{};  // of the velocities along the rows [m/s]
  double recovery = 0.0;   // by how much more the bodies are to be moved apart, and not sped up [m/s]
  double still = 0.0;      // velocity along the normal at which they do not part [m/s]
  double gives = 1e-3;     // at most, under a load: then it is made harder [m/s]
  double rebound = 0.0;    // by how much more they part than if they did not bounce [m/s]
  ContactVector impulse{};

  // As the solver goes on, and sets them:
  ContactVector miss;        // target less velocity
  ContactResponse response;  // to that
  ContactVector direction;   // of the slip before the last step
  ContactVector along;       // speeds along a direction of search
  double bound;              // of friction, where that is fixed [N s]
  double first_miss;         // along the normal, as the step begins [m/s]

  ContactRows() {}  // NOLINT: zeros of all that would take as long as the rest of a contact
};

//! A row whose impulse is (target - velocity) / softness within its limits: a stop, a drive, a mimic, a servo.
struct LimitedRow : RowSides {
  double target = 0.0;
  double softness = 0.0;
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  double recovery = 0.0;
  double impulse = 0.0;
  double* work = nullptr;  // what its work adds to in an audit

  // As the solver goes on:
  double miss = 0.0;   // target less velocity
  double slope = 0.0;  // of the impulse, as that grows
  double along = 0.0;  // speed along a direction of search

  //! The impulse that belongs to the miss.
  double impulse_of_miss() const { return std::min(std::max(miss / softness, low), high); }
};

//! Contacts of two movers that are open and have no rows. Each of its numbers times how far that velocity is from where
//! it started, summed up, is less than 1 while they cannot close.
struct OpenContacts : RowSides {
  bool closes = false;  // whether one may have, at velocities that the solver has seen
};

//! Velocities v, their inertia A, and the rows that act on them. Movers are groups with an inertia of their own.
class VelocitySystem {
 public:
  //! Some velocities in a row, with their inertia.
  struct Mover {
    int begin, count;
    std::size_t inertia;  // where it begins among all inertias
  };

  //! No movers, no rows.
  void clear();

  //! A mover of so many velocities. Its inertia is zero, and it starts at rest.
  int add_mover(int count);
  int begin(int mover) const { return movers_[static_cast<std::size_t>(mover)].begin; }
  int count(int mover) const { return movers_[static_cast<std::size_t>(mover)].count; }
  double* inertia(int mover) { return inertias_.data() + movers_[static_cast<std::size_t>(mover)].inertia; }
  double* free(int mover) { return free_.data() + movers_[static_cast<std::size_t>(mover)].begin; }

  //! The guess before `solve`, and what it found.
  double* velocities(int mover) { return velocities_.data() + movers_[static_cast<std::size_t>(mover)].begin; }
  const double* velocities(int mover) const {
    return velocities_.data() + movers_[static_cast<std::size_t>(mover)].begin;
  }

  //! Velocities that move bodies apart beside the velocities, for a step; zero where nothing is in another.
  const double* recovery(int mover) const { return recovery_.data() + movers_[static_cast<std::size_t>(mover)].begin; }

  //! Rows between two movers that have their inertias, with Jacobians of zero. References hold until the next one.
  ContactRows& add_contact(int a, int b, int rows = usual_rows);
  void drop_contact() { contacts_.pop_back(); }
  LimitedRow& add_limited(int a, int b);
  OpenContacts& open_contacts(int a, int b);
  double* numbers(std::size_t begin) { return numbers_.data() + begin; }
  const double* numbers(std::size_t begin) const { return numbers_.data() + begin; }

  //! 1 / inverse effective mass along a row, but for what the inertia has beside its diagonal.
  double inverse_mass(const RowSides& sides, int row) const;

  //! Entry of the Delassus matrix J A^-1 J' for two rows, with the diagonal of A alone.
  double delassus(const LimitedRow& a, const LimitedRow& b) const;

  //! Velocity along a row if these were all velocities, in the movers' order.
  double speed(const RowSides& sides, int row, const std::vector<double>& velocities) const;

  ContactVector speeds(const ContactRows& rows, const std::vector<double>& velocities) const;

  const std::vector<Mover>& movers() const { return movers_; }
  const Mover& mover(int index) const { return movers_[static_cast<std::size_t>(index)]; }
  std::vector<ContactRows>& contacts() { return contacts_; }
  const std::vector<ContactRows>& contacts() const { return contacts_; }
  std::vector<LimitedRow>& limited() { return limited_; }
  const std::vector<LimitedRow>& limited() const { return limited_; }
  const std::vector<OpenContacts>& open() const { return open_; }
  const std::vector<double>& all_free() const { return free_; }
  const std::vector<double>& all_velocities() const { return velocities_; }

  //! Calls `visit(mover, jacobian)` for each mover of some rows.
  template <typename Visit>
  void for_each_side(const RowSides& sides, const Visit& visit) const {
    if (sides.a >= 0) visit(mover(sides.a), numbers(sides.of_a));
    if (sides.b >= 0) visit(mover(sides.b), numbers(sides.of_b));
  }

 protected:
  std::vector<Mover> movers_;
  std::vector<double> inertias_, inverse_diagonal_, free_, velocities_, recovery_, numbers_;
  std::vector<ContactRows> contacts_;
  std::vector<LimitedRow> limited_;
  std::vector<OpenContacts> open_;

 private:
  void keep_diagonals();
  void add_sides(RowSides& sides, int a, int b, int rows);

  std::size_t kept_ = 0;  // movers whose diagonals are kept
};

//! Movers, contacts, limited rows and open contacts by their places in the system.
struct Island {
  std::vector<int> movers;
  std::vector<std::size_t> contacts, limited, open;
  std::vector<int> first;  //!< column of each row of its matrix that is not zero

  //! Whether nothing acts on it but its loads.
  bool free() const { return contacts.empty() && limited.empty() && open.empty(); }
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

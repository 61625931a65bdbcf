#pragma once
// The velocities at the end of a step, under Coulomb friction and limited impulses, by Newton's method.

#include <cstddef>
#include <vector>

#include "physics/solver/envelope_lu.hpp"
#include "physics/solver/friction_law.hpp"

namespace energymargin {

//! Some of all velocities, and what acts on them: `a` and `b` are movers, -1: none. Jacobians are in the solver's
//! numbers, row by row, as many columns as the mover has velocities.
struct RowSides {
  int a = -1, b = -1;
  std::size_t of_a = 0, of_b = 0;
};

//! A contact point: three rows, two along the plane of contact and one along its normal.
struct ContactRows : RowSides {
  FrictionLaw law;
  ContactVector target{};  // of the velocities along the rows [m/s]
  double recovery = 0.0;   // by how much more the bodies are to be moved apart, and not sped up [m/s]
  ContactVector impulse{};
};

//! A row whose impulse is (target - velocity) / softness within its limits: a stop, a drive, a mimic, a servo.
struct LimitedRow : RowSides {
  double target = 0.0;
  double softness = 0.0;
  double low = 0.0, high = 0.0;
  double recovery = 0.0;
  double impulse = 0.0;
};

//! Finds velocities v with A (v - v_free) = sum of J' impulse(J v). Movers are groups of velocities with an inertia A
//! of their own; those that constraints connect are an island, and each island is solved on its own.
//!
//! Newton's method on Coulomb's law converges in one to three iterations from a good guess. Where some iterations bring
//! the error down by too little, as in a blow, sweeps of sequential impulses find out what opens, sticks and slides,
//! and Newton's method goes on from there.
class NewtonSolver {
 public:
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

  //! Velocities that move bodies apart beside the velocities, and are gone after the step; zero where nothing overlaps.
  const double* recovery(int mover) const { return recovery_.data() + movers_[static_cast<std::size_t>(mover)].begin; }

  //! Rows between two movers, with Jacobians of zero. These movers have their inertias by then. References hold until
  //! the next one.
  ContactRows& add_contact(int a, int b);
  void drop_contact() { contacts_.pop_back(); }
  LimitedRow& add_limited(int a, int b);
  double* numbers(std::size_t begin) { return numbers_.data() + begin; }
  const double* numbers(std::size_t begin) const { return numbers_.data() + begin; }

  //! 1 / inverse effective mass along a row, but for what the inertia has beside its diagonal.
  double inverse_mass(const RowSides& sides, int row) const;

  //! Velocity along a row if these were all velocities, in the movers' order.
  double speed(const RowSides& sides, int row, const std::vector<double>& velocities) const;

  ContactVector speeds(const ContactRows& rows, const std::vector<double>& velocities) const;

  //! Whether all islands converged: the error of each velocity is at most `tolerance` of the impulses on its mover.
  bool solve(int iterations, double tolerance);

  //! After `solve`, for other targets of the same rows.
  bool solve_again(int iterations, double tolerance);

  std::vector<ContactRows>& contacts() { return contacts_; }
  const std::vector<ContactRows>& contacts() const { return contacts_; }
  const std::vector<LimitedRow>& limited() const { return limited_; }
  const std::vector<double>& all_velocities() const { return velocities_; }

  //! Iterations of the last `solve`, of all islands.
  int iterations() const { return iterations_; }

 private:
  struct Mover {
    int begin, count;
    std::size_t inertia;
    int island;
    int local;  // first row in the island's matrix
  };
  struct Island {
    std::vector<int> movers, contacts, limited;
    std::vector<int> first;  // columns of the rows of its matrix
    bool free() const { return contacts.empty() && limited.empty(); }
  };

  void keep_diagonals();
  void add_sides(RowSides& sides, int a, int b, int rows);
  int root(int mover);
  void join(const RowSides& sides);
  void find_islands();
  void order(Island& island);
  bool solve(Island& island, int iterations, double tolerance);
  template <typename Respond>
  double evaluate(const Island& island, const Respond& respond);
  double coulomb_error(const Island& island, bool after_step);
  double error(const Island& island) const;
  void save(const Island& island);
  bool harden(const Island& island);
  void keep_directions(const Island& island);
  void prepare_sweeps(const Island& island);
  void start_sweeps(const Island& island);
  void sweep(const Island& island, int sweeps);
  void resolve_contact(std::size_t k);
  void resolve_limited(std::size_t k);
  void push(const RowSides& sides, int row, std::size_t of_a, std::size_t of_b, double impulse);
  double go_on_from_sweeps(const Island& island, int sweeps, int& left, double tolerance);
  void take_swept(const Island& island);
  bool find_direction(const Island& island);
  void assemble(const Island& island);
  template <typename Add>
  void add_blocks(const RowSides& sides, const Add& add);
  void add_contact_block(const RowSides& sides, const ContactResponse& response);
  void add_limited_block(const RowSides& sides, double slope);
  void add_step(const Island& island, double length);
  void balance(const Island& island);
  void recover(const Island& island);

  std::vector<Mover> movers_;
  std::vector<double> inertias_, inverse_diagonal_, free_, velocities_, recovery_, numbers_;
  std::size_t kept_ = 0;  // movers whose diagonals are kept
  std::vector<ContactRows> contacts_;
  std::vector<LimitedRow> limited_;
  std::vector<Island> islands_;
  std::size_t island_count_ = 0;
  std::vector<int> parents_;

  std::vector<ContactVector> misses_;  // of the contacts
  std::vector<double> limited_misses_;
  std::vector<ContactResponse> responses_;
  std::vector<std::array<double, 2>> directions_;  // of the slip of contacts, before the last step
  std::vector<double> limited_slopes_;
  std::vector<double> residual_, turnover_, direction_, saved_;  // of the velocities
  std::vector<double> factors_, changes_;                        // scratch

  struct Swept {  // a contact's impulse, and how velocities answer to one along its rows: where that is in `answers_`
    ContactVector impulse{};
    ContactVector inverse_masses{};
    std::size_t of_a = 0, of_b = 0;
  };
  struct SweptRow {
    double impulse = 0.0, inverse_mass = 0.0;
    std::size_t of_a = 0, of_b = 0;
  };
  std::vector<Swept> swept_;
  std::vector<ContactVector> predicted_;  // impulses of contacts after a linear step
  std::vector<SweptRow> swept_rows_;
  std::vector<double> answers_, inverses_, swept_velocities_;

  EnvelopeLu matrix_;
  bool stopped_ = false;  // whether something was taken to stick as it would have turned round
  int iterations_ = 0;
};

}  // namespace energymargin

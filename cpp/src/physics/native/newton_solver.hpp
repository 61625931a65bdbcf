#pragma once
// The velocities at the end of a step, under Coulomb friction and limited impulses, by Newton's method.

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "physics/native/envelope_lu.hpp"
#include "physics/native/velocity_system.hpp"

namespace energymargin {

//! Finds velocities v at which the residual r(v) = A (v - v_free) - sum of J' lambda(target - J v) is zero, island by
//! island: v becomes v - H^-1 r, with H = A + sum of J' (d lambda / d miss) J. Where that brings the error down by too
//! little, friction with fixed bounds tells it where to start; where that does not help, contacts that harden gradually
//! do. docs/engineering/contact.md#the-solver has the steps.
class NewtonSolver : public VelocitySystem {
 public:
  NewtonSolver() = default;

  //! Whether all islands converged: the error of each velocity is at most `tolerance` of the impulses on its mover.
  //! `again`: for other targets of the same rows.
  bool solve(int iterations, double tolerance, bool again = false);

  //! Finds what moves bodies out of each other, beside the velocities of the last `solve`.
  void recover();

  //! Those of the last `solve`.
  const Islands& islands() const { return islands_; }

  //! Whether open contacts may have closed at velocities that it has seen since the last one that was not `again`.
  bool closes() const {
    return std::any_of(open_.begin(), open_.end(), [](const OpenContacts& each) { return each.closes; });
  }

  //! Iterations of the last `solve`, of all islands.
  int iterations() const { return iterations_; }

 private:
  struct HardRows {
    std::vector<ContactRows> contacts;
    std::vector<LimitedRow> limited;
  };

  bool solve_island(const Island& island, int iterations, double tolerance);
  bool iterate(const Island& island, int& left, double tolerance, double error, bool bounded);
  double bounded_error(const Island& island, int& left, double tolerance);
  bool minimize(const Island& island, int& left, double tolerance);
  double step_length(const Island& island);
  double pull(const Island& island, double length) const;
  void bound_by_start(const Island& island);
  void bound_by_normals(const Island& island);
  void find_gone(const Island& island);
  bool were_squeezed() const;
  void look_at_open(const Island& island, double length);
  template <typename Respond>
  double evaluate(const Island& island, const Respond& respond);
  double coulomb_error(const Island& island, bool after_step);
  double tresca_error(const Island& island);
  double error(const Island& island) const;
  void copy(const Island& island, const std::vector<double>& from, std::vector<double>& to) const;
  bool harden(const Island& island);
  void soften(const Island& island, const HardRows& hard, double level);
  double descend(const Island& island, int most, double tolerance);
  bool find_gradually(const Island& island, double level, double tolerance);
  bool harden_gradually(const Island& island, double level, double tolerance);
  void keep_impulses(const Island& island);
  void keep_directions(const Island& island);
  bool find_direction(const Island& island);
  void assemble(const Island& island);
  template <typename Visit>
  void for_each_mover(const RowSides& sides, const Visit& visit);
  void add_contact_block(const ContactRows& rows);
  void add_limited_block(const LimitedRow& row);
  void add_step(const Island& island, double length);
  void balance(const Island& island);
  void recover(const Island& island);

  Islands islands_;
  EnvelopeLu matrix_;
  std::vector<double> residual_, turnover_, direction_, saved_, start_, found_;  // of the velocities
  std::vector<double> first_;                                                    // velocities
  std::vector<double> factors_, changes_;                                        // scratch
  std::vector<std::size_t> gone_;                                                // contacts
  bool stopped_ = false;  // whether something was taken to stick as it would have turned round
  int iterations_ = 0;
  int soft_left_ = 0;  // iterations that an island has left from softer rows on
};

}  // namespace energymargin

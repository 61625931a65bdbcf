#pragma once
// Constraints of the velocities of bodies and joints, solved by sequential impulses.

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

namespace energymargin {

//! Velocities of one body or one tree. They come in pairs, as two numbers are worked on at once.
struct VelocitySpan {
  std::size_t begin = 0;  // among all velocities
  std::size_t pairs = 0;  // 0: of a fixed body, which has none
};

//! Keeps speed + softness * impulse at a target, as far as an impulse within its limits can.
struct VelocityRow {
  VelocitySpan a, b;        // what it acts on
  std::size_t numbers = 0;  // where its own begin: Jacobian and response of a, then of b
  double effective_mass = 0.0, inverse_effective_mass = 0.0;
  double target = 0.0;
  double softness = 0.0;
  double impulse = 0.0;  // so far
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  double* stored = nullptr;  // where the impulse is kept for the next step
};

//! The rows of one step, and the velocities, which change with each impulse.
class VelocityRows {
 public:
  //! Friction of a contact along two directions: the two impulses stay within a circle.
  struct Friction {
    VelocityRow first, second;
    double coefficient;
    std::size_t normal;  // index of the contact's normal row
  };
  //! An impulse that changes positions and not velocities, where two bodies overlap.
  struct Split {
    std::size_t normal;
    double target;  // [m/s]
    double impulse = 0.0;
  };

  std::vector<VelocityRow> motors, joints, normals;
  std::vector<Friction> frictions;
  std::vector<Split> splits;

  //! Of so many velocities, which begin at 0, as those of split impulses do. Removes all rows.
  void clear(std::size_t velocities);

  double* velocities() { return velocities_.data(); }
  const double* velocities() const { return velocities_.data(); }
  const double* split_velocities() const { return split_velocities_.data(); }

  //! A row on a and b. `jacobian(of_a, of_b)` adds to their Jacobians, which are one where a and b are;
  //! `response(whether of a, jacobian, response)` sets the changes by an impulse of 1.
  template <typename Jacobian, typename Response>
  VelocityRow row(const VelocitySpan& a, const VelocitySpan& b, const Jacobian& jacobian, const Response& response);

  //! The row begins with an impulse.
  void start(VelocityRow& row, double impulse);

  //! Rounds over all rows, until the largest square of a change of velocity is no more than `tolerance` [m^2/s^2].
  //! False if there are too few rounds for that.
  bool solve(int rounds, int joint_rounds, double tolerance);

  //! Speed along a row if these were all velocities.
  double speed(const VelocityRow& row, const double* velocities) const;

 private:
  double iterate(int round, int joint_rounds);
  double iterate_splits();
  double set_impulse(VelocityRow& row, double impulse);
  double resolve(VelocityRow& row);
  double resolve(Friction& friction);
  double change(const VelocityRow& row) const;
  void push(const VelocityRow& row, double impulse, double* velocities) const;

  std::vector<double> numbers_, velocities_, split_velocities_;
};

template <typename Jacobian, typename Response>
VelocityRow VelocityRows::row(const VelocitySpan& a, const VelocitySpan& b, const Jacobian& jacobian,
                              const Response& response) {
  VelocityRow row;
  row.a = a;
  const bool one = a.pairs > 0 && a.begin == b.begin;
  if (!one) row.b = b;
  row.numbers = numbers_.size();
  numbers_.resize(row.numbers + 4 * (row.a.pairs + row.b.pairs), 0.0);
  double* of_a = numbers_.data() + row.numbers;
  double* of_b = one ? of_a : of_a + 4 * row.a.pairs;
  jacobian(of_a, of_b);
  const auto respond = [&](bool is_a, std::size_t count, double* of_span) {
    if (count > 0) response(is_a, of_span, of_span + count);
    for (std::size_t i = 0; i < count; ++i) row.inverse_effective_mass += of_span[i] * of_span[count + i];
  };
  respond(true, 2 * row.a.pairs, of_a);
  respond(false, 2 * row.b.pairs, of_b);
  return row;
}

}  // namespace energymargin

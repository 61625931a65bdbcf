#pragma once
// The constraints of contacts between free bodies, solved by sequential impulses.

#include <btBulletDynamicsCommon.h>

#include <Eigen/Core>
#include <array>
#include <vector>

namespace energymargin {

//! A linear quantity and an angular one, along each axis of the world.
using Twist = std::array<Eigen::Array2d, 3>;

//! What a row is to one of its bodies.
struct RowSide {
  int body = -1;   // index of a moving body; -1: none, for a fixed body
  Twist scaled;    // Jacobian, which is direction and arm x direction, times the row's effective mass
  Twist response;  // change of the body's velocities by an impulse of 1
};

//! A constraint of the relative velocity along one direction at one point.
struct ContactRow {
  ContactRow() {}  // leaves the numbers for the caller to set: rows are made anew in each step

  RowSide first, second;          // the first one moves
  double target;                  // impulse that the velocities before the step ask for [N s]
  double inverse_effective_mass;  // [1/kg]
  double impulse;                 // so far [N s]
};

//! Keeps bodies from going into each other.
struct NormalRow : ContactRow {
  double split_target;   // as `target`, of the split impulse, which changes positions and not velocities
  double split_impulse;  // so far
  btManifoldPoint* point;
};

//! Slows sliding, as far as the normal impulse holds.
struct FrictionRow : ContactRow {
  double friction;
  std::size_t normal;  // index of its normal row
  double* stored;      // where the contact point keeps the impulse for the next step
};

//! Keeps a body at a velocity, as far as its limit allows.
struct MotorRow : ContactRow {
  double limit;  // of the impulse [N s]
};

//! The rows of one step, and what they have changed so far. They are those of Bullet's own solver,
//! btSequentialImpulseConstraintSolver. What makes it faster: fixed bodies have no part in it, and
//! linear and angular parts are worked on at once.
class ContactRows {
 public:
  //! Of `bodies` moving bodies.
  void clear(std::size_t bodies);

  MotorRow& add_motor();
  NormalRow& add_normal();
  FrictionRow& add_friction();

  //! Applies what the impulses that a row begins with have changed.
  void apply(const ContactRow& row);
  void apply_split(const NormalRow& row);

  //! One round over all rows; returns the largest square of a change of velocity [m^2/s^2].
  double iterate();
  double iterate_split_impulses();

  //! Changes of a body's velocities by the impulses, and its velocities of this step by the split impulses.
  const Twist& change(std::size_t body) const { return changes_[body]; }
  const Twist& split(std::size_t body) const { return split_twists_[body]; }

  const std::vector<MotorRow>& motors() const { return motors_; }
  const std::vector<NormalRow>& normals() const { return normals_; }
  const std::vector<FrictionRow>& frictions() const { return frictions_; }

 private:
  std::vector<MotorRow> motors_;
  std::vector<NormalRow> normals_;
  std::vector<FrictionRow> frictions_;
  std::vector<Twist> changes_, split_twists_;
};

}  // namespace energymargin

#pragma once
// The poses of one object that are looked at, in a plane, along lines, or of a ball inside of it; and between what its
// potential energy lies there.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/angles.hpp"
#include "bounds/barrier_bound.hpp"
#include "bounds/convex_piece.hpp"

namespace energymargin::bounds {

//! Position of the reference point [m], and the turn from the start about the one free axis [rad].
using Coordinates = Eigen::Vector4d;

inline constexpr int turn_axis = 3;  // of the coordinates

//! All coordinates between two.
struct PoseCell {
  Coordinates low = Coordinates::Zero();
  Coordinates high = Coordinates::Zero();

  Coordinates center() const { return 0.5 * (low + high); }
  Coordinates half() const { return 0.5 * (high - low); }
};

//! How far a point at a distance of 1 moves by a turn of up to so much.
inline double chord(double turn) { return 2.0 * std::sin(0.5 * std::min(turn, pi)); }

//! A piece of the object, in its frame.
struct ObjectPiece {
  ConvexPiece piece;
  double reach;       //!< of its farthest point from the axis of turns [m]
  ConvexPiece whole;  //!< the piece that this one lies in: as deep as that one may be in a body, this one may be
};

//! Coordinates of an object. One that is locked to turns about one axis, or to none, has its own pieces. One that turns
//! freely is a ball inside of it: what holds the ball holds the object, whatever its turn.
class ObjectSpace {
 public:
  explicit ObjectSpace(const Subject& subject);

  //! Of the object's frame, at a turn from the start.
  Pose pose(const Coordinates& at) const;

  Coordinates start() const { return start_; }
  const Vector3& reference() const { return reference_; }  //!< of turns, in the object's frame [m]
  bool free(int axis) const { return free_[static_cast<std::size_t>(axis)]; }
  bool any_turn() const { return any_turn_; }
  const std::vector<ObjectPiece>& pieces() const { return pieces_; }
  double radius() const { return radius_; }  //!< of the farthest point from the axis of turns [m]

  //! The inner radius of the thinnest piece; 0 without pieces [m].
  double thickness() const;

  //! How far a point of the object's frame is from where `pose` has it, at most, anywhere in a cell, along each axis of
  //! the world and about the turns [m].
  Vector3 slack(const Coordinates& half, const Vector3& point) const;

 private:
  Vector3 reference_ = Vector3::Zero();  // in the object's frame
  Quaternion orientation_;               // at the start
  Vector3 axis_ = Vector3::UnitZ();      // of turns, in the world
  Coordinates start_ = Coordinates::Zero();
  std::array<bool, 4> free_{};
  bool any_turn_ = false;
  std::vector<ObjectPiece> pieces_;
  double radius_ = 0.0;
};

//! A simulation kicks the object by the forces at the beginning of a step, and moves it by the velocities at its end.
//! So what it conserves is not the energy T + V, but T + V - h/2 x force x velocity, exactly so on lines and parabolas:
//! an object may pass where the energy alone would stop it. The last term is at most `lag` x sqrt(T).
struct EnergyRange {
  double low, high;  //!< [J]
  double lag = 0.0;  //!< [sqrt(J)]

  //! What the simulation has conserved where the object has at least this kinetic energy [J]: no less than this.
  double passed(double kinetic = 0.0) const {
    const double root = std::max(std::sqrt(kinetic), 0.5 * lag);
    return low + root * (root - lag);
  }
};

//! Of gravity and the constant force on the object, and of the springs between it and what stays where it is.
class PotentialBounds {
 public:
  PotentialBounds(const Subject& subject, const ObjectSpace& space);

  EnergyRange operator()(const PoseCell& cell) const;

  //! At the start, with what the simulation conserves beside the energy there [J].
  double start() const { return start_; }

  //! No lower than anywhere beyond `face` along an axis, on the upper side or the lower; -inf: it may fall for ever.
  double beyond(int axis, bool upper, double face) const;

  const Vector3& load() const { return load_; }  //!< of gravity and the constant force, along free axes [N]
  bool has_springs() const { return !springs_.empty(); }

 private:
  struct Spring {
    Vector3 point;   // in the object's frame
    Vector3 anchor;  // in the world
    double stiffness, rest_length;
    double inverse_mass;  // effective, of the point: at most [1/kg]
  };

  double lag(double force, double inverse_mass) const { return std::sqrt(0.5 * inverse_mass) * step_ * force; }

  const ObjectSpace& space_;
  Vector3 load_, center_;       // of mass, in the object's frame
  double step_, inverse_mass_;  // of the centre of mass [1/kg]
  std::vector<Spring> springs_;
  double start_ = 0.0;
};

}  // namespace energymargin::bounds

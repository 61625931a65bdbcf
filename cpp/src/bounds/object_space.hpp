#pragma once
// The poses of one object that are looked at: in a plane, along lines, or of a ball inside of it.

#include <array>
#include <vector>

#include "bounds/convex_piece.hpp"
#include "bounds/pose_cell.hpp"
#include "energymargin/problem.hpp"

namespace energymargin::bounds {

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
  ObjectSpace(const Problem& problem, std::size_t object);

  //! Of the object's frame, at a turn from the start.
  Pose pose(const Coordinates& at) const;

  Coordinates start() const { return start_; }
  const Vector3& reference() const {
    return reference_;
  }  //!< the point that turns are about, in the object's frame [m]
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

}  // namespace energymargin::bounds

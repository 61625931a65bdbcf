#pragma once
// How deep two convex pieces are in each other, for sure.

#include "bounds/convex_piece.hpp"

namespace energymargin::bounds {

//! Lower bounds of the penetration depth, the least way by which one of two pieces has to move for the other to be free
//! [m]; negative: they may be apart by that.
struct Overlap {
  double middle;   //!< as they stand
  double certain;  //!< also if the first one turns
};

//! How a piece may be turned: each point by up to `chord` times its distance from a point of the piece's frame.
struct Turns {
  Vector3 about;
  double chord;
};

//! Of two convex pieces. `pose` places `piece` in the frame of `other`. The search for better bounds ends when the
//! certain one is above `enough`.
//!
//! A ball of radius piece.depth(p) + other.depth(p) tells why, for any point p: p is so deep in the two together that
//! no shorter way parts them. When the piece turns, its part of the ball moves with p. Both depths are concave, and so
//! is their sum; a bound is its highest value found.
Overlap find_overlap(const ConvexPiece& piece, const Pose& pose, const ConvexPiece& other, const Turns& turns,
                     double enough);

//! The penetration depth of a piece and the half space below a plane, in whose frame `pose` is [m].
double overlap_with_plane(const ConvexPiece& piece, const Pose& pose, const Plane& plane);

}  // namespace energymargin::bounds

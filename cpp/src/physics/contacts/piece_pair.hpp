#pragma once
// Two convex pieces that move, and how far they can.

#include <btBulletDynamicsCommon.h>

#include "physics/sweep.hpp"

namespace energymargin {

//! A convex piece of a body.
struct ConvexPiece {
  const btConvexShape* shape;
  btTransform in_body;
  bool at_origin;      // whether it stands in its body's own frame
  double reach;        // of its core's points from the body's origin; its core is what is left without its margin [m]
  double half_extent;  // the smallest [m]

  btTransform pose(const btTransform& body) const { return at_origin ? body : body * in_body; }
};

//! Two pieces may overlap a little: by less than their margins, so that the separating direction is known,
//! and by less than a third of the thinner one's half extent, so that they are pushed out to the side where they came
//! from.
class PiecePair {
 public:
  PiecePair(const ConvexPiece& a, const ConvexPiece& b);

  //! Forgets which direction separated them, for a new rollout.
  void forget() {
    known_ = began_deep_ = false;
    fresh_ = true;
  }

  //! The share, from 0 to 1, of their ways that they can go without passing into each other: conservative advancement
  //! (Mirtich 1996), where no direction separates them on the whole way.
  double safe_share(const Sweep& a, const Sweep& b);

  //! Whether they are deeper in each other than they may be, where they stand now.
  bool too_deep(const btTransform& a, const btTransform& b) const;

 private:
  struct Ways;

  void find_normal(const Ways& ways);
  double gap(const Ways& ways, double share) const;
  double gap(const btTransform& a, const btTransform& b, const btVector3& normal) const;
  bool keeps_apart(const Ways& ways) const;
  bool stay_apart(const Ways& ways, double now) const;
  bool slide(const Ways& ways, double now) const;
  double approach(const Ways& ways) const;
  double next_look(const Ways& ways, double share, double room) const;
  double advance(const Ways& ways, double now);
  double linear_share(const Ways& ways, double now) const;
  double least(double now) const;
  double contact(double now) const;

  ConvexPiece a_, b_;
  double margins_;    // of both [m]
  double allowed_;    // overlap [m]
  btVector3 normal_;  // from b to a, the last that separated them, if `known_`
  bool known_ = false;
  bool fresh_ = true;        // nothing was asked since `forget`
  bool began_deep_ = false;  // deeper than they may be, and still are
};

}  // namespace energymargin

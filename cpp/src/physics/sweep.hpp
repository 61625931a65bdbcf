#pragma once
// A body's motion through a part of a step.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! The turn that Bullet gives a body that is asked for `turn` [rad]: the same up to an eighth of a circle, less beyond,
//! never more than a half.
btVector3 integrated_turn(const btVector3& turn);

//! A pose that has gone a share of a way, and turned by that share about an axis that stays.
btTransform integrated_pose(const btTransform& start, const btVector3& way, const btVector3& turn, double share);

//! A body on its way through a part of a step.
struct Sweep {
  btTransform start;
  btVector3 linear, angular;  // over the whole of it, as they are at the start [m], [rad]
  bool screw;                 // of a link: its velocity turns with it, as about the pivot of a joint

  btTransform at(double share) const;

  //! The first share of it.
  Sweep first(double share) const { return {start, linear * share, angular * share, screw}; }

  //! A direction that turns with it.
  btVector3 turned(const btVector3& direction, double share) const;

  //! How far it can move along a direction on its whole way [m].
  double along(const btVector3& direction) const;

  //! By how much the velocity of a point at `reach` from the body's origin changes, over the whole of it [m].
  double bend(double reach) const;
};

}  // namespace energymargin

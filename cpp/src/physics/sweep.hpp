#pragma once
// A body's motion through a substep.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! A pose after a way [m] and a turn [rad], about an axis that stays.
btTransform moved_pose(const btTransform& start, const btVector3& way, const btVector3& turn);

//! A body on its way through a substep.
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

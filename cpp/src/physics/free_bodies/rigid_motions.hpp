#pragma once
// How rigid bodies stand and move, to go back to.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/stepper.hpp"

namespace energymargin {

class RigidMotions {
 public:
  void keep(const std::vector<btRigidBody*>& bodies);

  //! Of the bodies that were kept.
  void undo(const std::vector<btRigidBody*>& bodies) const;

  //! Puts the bodies that were kept back to where they stood; they go on as they move now.
  void undo_split_impulses(const std::vector<btRigidBody*>& bodies) const;

 private:
  struct Motion {
    btTransform pose;
    Velocity velocity;
  };
  std::vector<Motion> motions_;
};

//! Each at the index of its body in the scene.
void read_velocities(const std::vector<btRigidBody*>& bodies, std::vector<Velocity>& velocities);

//! What Bullet makes of a turn in a single motion [rad]: beyond an eighth of a circle less of it, and at most a half.
btVector3 made_turn(const btVector3& turn);

//! A pose that has gone a share of a way, and turned by that share about an axis that stays.
btTransform moved(const btTransform& start, const btVector3& way, const btVector3& turn, double share);

//! Moves bodies with their velocities for a share of `duration` [s], turning by that share of what the whole of it
//! makes.
void move(const std::vector<btRigidBody*>& bodies, double duration, double share);

}  // namespace energymargin

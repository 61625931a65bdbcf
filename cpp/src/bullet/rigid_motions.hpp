#pragma once
// How rigid bodies stand and move, to go back to.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "stepper.hpp"

namespace energymargin {

class RigidMotions {
 public:
  void keep(const std::vector<btRigidBody*>& bodies);

  //! Of the bodies that were kept.
  void undo(const std::vector<btRigidBody*>& bodies) const;

 private:
  struct Motion {
    btTransform pose;
    Velocity velocity;
  };
  std::vector<Motion> motions_;
};

//! Each at the index of its body in the scene.
void read_velocities(const std::vector<btRigidBody*>& bodies, std::vector<Velocity>& velocities);

//! Moves bodies with their velocities for `duration` [s].
void move(const std::vector<btRigidBody*>& bodies, double duration);

}  // namespace energymargin

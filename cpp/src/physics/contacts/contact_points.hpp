#pragma once
// The contact points that a dispatcher keeps from one step to the next.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! All of them, with the forces of a step of `duration` [s].
std::vector<Contact> contact_points(const btCollisionDispatcher& dispatcher, const Scene& scene, double duration);

//! Turns the normals of points between two moving bodies. Where Bullet does not find a point anew, as with two boxes
//! that do not overlap, it keeps the normal of old, however far the bodies have turned since. So a normal turns with
//! the body that turned less: with both, if they turn as one; with the face, if a round body rolls on it. `before` has
//! the axes of all bodies before the step.
void turn_normals(btDispatcher& dispatcher, const std::vector<btMatrix3x3>& before);

}  // namespace energymargin

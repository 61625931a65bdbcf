#pragma once
// Contacts of cylinders, spheres and capsules.

class btCollisionDispatcher;

namespace energymargin {

//! Where one of two solids is a cylinder, a sphere or a capsule: their closest points, as Bullet finds them, at a
//! fraction of the cost.
void use_round_contacts(btCollisionDispatcher& dispatcher);

}  // namespace energymargin

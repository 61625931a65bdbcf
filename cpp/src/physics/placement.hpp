#pragma once
// The bodies of a scene where a state puts them: who is near whom, and how far apart.

#include "energymargin/world.hpp"
#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/collision_pairs.hpp"

namespace energymargin {

//! Bodies with their shapes, in no motion: a Simulation has one, and who asks for distances alone needs no more.
class Placement {
 public:
  //! The scene outlives this.
  explicit Placement(const Scene& scene) : bodies(scene), pairs(scene, bodies.colliders()), scene_(scene) {}

  //! Puts all bodies where a state says; no contact of the past is left.
  void restore(const State& state) {
    bodies.restore(state);
    pairs.forget();
  }

  //! A body as Bullet sees it.
  const btCollisionObject& collider(std::size_t body) const { return *bodies.colliders()[body]; }

  //! As World::deepest_contact.
  Contact deepest_contact();

  MovingBodies bodies;
  CollisionPairs pairs;

 private:
  const Scene& scene_;
};

}  // namespace energymargin

#pragma once
// The bodies of a scene where a state puts them: who is near whom, and how far apart.

#include "energymargin/world.hpp"
#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/collision_filter.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "physics/contacts/dispatcher.hpp"
#include "physics/pair_query.hpp"

namespace energymargin {

//! Bodies with their shapes, in no motion: a Simulation has one, and who asks for distances alone needs no more.
class Placement {
 public:
  //! The scene outlives this.
  explicit Placement(const Scene& scene)
      : scene_(scene),
        filter_(scene),
        pair_query_(dispatcher_),
        bodies_(scene),
        pairs_(dispatcher_.bullet(), filter_, bodies_.colliders()) {}
  Placement(const Placement&) = delete;
  Placement& operator=(const Placement&) = delete;

  //! Puts all bodies where a state says; no contact of the past is left.
  void restore(const State& state) {
    bodies_.restore(state);
    pairs_.forget();
  }

  MovingBodies& bodies() { return bodies_; }
  const MovingBodies& bodies() const { return bodies_; }
  CollisionPairs& pairs() { return pairs_; }
  const CollisionPairs& pairs() const { return pairs_; }

  //! A body as Bullet sees it.
  const btCollisionObject& collider(std::size_t body) const { return *bodies_.colliders()[body]; }

  bool can_collide(std::size_t a, std::size_t b) const { return filter_(a, b); }

  //! Closest points of two bodies by their indices in the scene; none farther apart than `reach` [m].
  ClosestPoints closest_points(std::size_t a, std::size_t b, double reach) {
    return pair_query_(*bodies_.colliders()[a], *bodies_.colliders()[b], reach);
  }

  //! As World::deepest_contact.
  Contact deepest_contact();

 private:
  const Scene& scene_;
  CollisionFilter filter_;
  ContactDispatcher dispatcher_;
  PairQuery pair_query_;
  MovingBodies bodies_;
  CollisionPairs pairs_;
};

}  // namespace energymargin

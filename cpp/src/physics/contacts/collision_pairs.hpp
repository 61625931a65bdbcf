#pragma once
// The pairs of bodies that may touch, and where they do.

#include <btBulletDynamicsCommon.h>

#include <utility>
#include <vector>

#include "physics/contacts/collision_filter.hpp"
#include "physics/contacts/contact_point.hpp"
#include "physics/contacts/near_bounds.hpp"
#include "physics/contacts/piece_pair.hpp"

namespace energymargin {

//! Two bodies whose bounds are, or have been, near each other.
struct CollisionPair {
  std::size_t a, b;                           // indices in the scene, a < b
  double reach;                               // distance of the bounds from which on they do not touch [m]
  double friction;                            // coefficient of their contacts
  double gap = 0.0;                           // of the bounds, negative where they overlap [m]
  btCollisionAlgorithm* algorithm = nullptr;  // of the dispatcher's pool, while they may touch
  std::vector<PiecePair> pieces{};            // for continuous collision, made when it first asks
};

//! Collision detection. Of a few bodies every pair is kept from the start; those out of a contact's reach cost no more
//! than a test of their bounds. Of many, pairs are kept once they come near each other.
class CollisionPairs {
 public:
  //! Up to how many bodies every pair is kept.
  static constexpr std::size_t few_bodies = 32;

  //! Of the bodies of a scene, in its order. The dispatcher and the filter outlive this.
  CollisionPairs(btCollisionDispatcher& dispatcher, const CollisionFilter& can_collide,
                 const std::vector<btCollisionObject*>& colliders, std::size_t few = few_bodies);
  ~CollisionPairs() { forget(); }
  CollisionPairs(const CollisionPairs&) = delete;
  CollisionPairs& operator=(const CollisionPairs&) = delete;

  //! Forgets all contacts, and all directions that separated pieces.
  void forget();

  //! Finds the contacts of the bodies as they stand.
  void update();

  //! All contacts, pair by pair in the order of their bodies.
  std::vector<ContactPoint>& points() { return points_; }
  const std::vector<ContactPoint>& points() const { return points_; }

  //! By their indices, those within reach of a contact, and maybe others; bounds as they stood in the last `update`.
  const std::vector<CollisionPair>& pairs() const { return pairs_; }

  //! The same with those whose gap is at most the sum of the bodies' `travels` [m].
  std::vector<CollisionPair>& within(const std::vector<double>& travels);

  //! Pairs of bodies within reach of a contact as they stand, by their indices.
  std::vector<std::pair<std::size_t, std::size_t>> near();

 private:
  void set_bounds();
  void find(const std::vector<double>& reaches);
  void add(std::size_t a, std::size_t b);
  void detect(CollisionPair& pair);
  void drop(CollisionPair& pair);

  btCollisionDispatcher& dispatcher_;
  const CollisionFilter& can_collide_;
  btDispatcherInfo info_;
  std::vector<btCollisionObject*> colliders_;
  std::vector<Bounds> bounds_;   // of the bodies
  std::vector<double> reaches_;  // of their contacts [m]
  std::vector<CollisionPair> pairs_;
  bool all_kept_;
  SweepAndPrune sweep_and_prune_;
  std::vector<bool> found_;  // by a * (number of bodies) + b: that a sweep has found the pair since `forget`
  std::vector<ContactPoint> points_;
};

}  // namespace energymargin

#pragma once
// The pairs of bodies that may touch, and where they do.

#include <btBulletDynamicsCommon.h>

#include <vector>

namespace energymargin {

//! Collision detection for the few bodies of a scene. Every pair that can collide is kept from the
//! start; those whose bounds are out of a contact's reach cost no more than that test.
class CollisionPairs {
 public:
  explicit CollisionPairs(btCollisionDispatcher& dispatcher) : dispatcher_(dispatcher) {}
  ~CollisionPairs() { forget(); }
  CollisionPairs(const CollisionPairs&) = delete;
  CollisionPairs& operator=(const CollisionPairs&) = delete;

  //! In the order of their indices in the scene, the lower one first.
  void add(btCollisionObject& a, btCollisionObject& b);

  //! Forgets all contacts.
  void forget();

  //! Finds the contacts of the bodies as they stand.
  void update();

  //! Distance of the bounds of the pair that was added as number `index`, as they stood in the last `update`; negative
  //! where the bounds overlap [m].
  double gap(std::size_t index) const { return pairs_[index].gap; }

  //! Those with contacts, by the indices of their bodies.
  const std::vector<btPersistentManifold*>& touching() const { return touching_; }

 private:
  struct BoundedObject {
    btCollisionObject* object;
    bool moves;
    btVector3 low, high;  // bounds
  };
  struct Pair {
    std::size_t a, b;                           // in objects_
    double reach;                               // from which on they do not touch
    double gap = 0.0;                           // of the bounds
    btCollisionAlgorithm* algorithm = nullptr;  // of the dispatcher's pool
  };

  std::size_t index_of(btCollisionObject& object);
  double gap_of(const Pair& pair) const;
  void detect(Pair& pair);
  void drop(Pair& pair);

  btCollisionDispatcher& dispatcher_;
  btDispatcherInfo info_;
  std::vector<BoundedObject> objects_;
  std::vector<Pair> pairs_;
  std::vector<btPersistentManifold*> touching_;
  btManifoldArray manifolds_;
};

}  // namespace energymargin

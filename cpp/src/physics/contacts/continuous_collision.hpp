#pragma once
// Keeps bodies from passing through each other between two steps.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/contacts/collision_pairs.hpp"
#include "physics/contacts/piece_pair.hpp"
#include "physics/shapes.hpp"
#include "physics/velocity.hpp"

namespace energymargin {

//! Says how long bodies can go on as they move before one is too deep in another.
class ContinuousCollision {
 public:
  //! `colliders` are the scene's bodies. The scene outlives this.
  ContinuousCollision(const Scene& scene, const std::vector<btCollisionObject*>& colliders);

  //! The share, from 0 to 1, of the next `duration` [s] for which all bodies can go on with `velocities`, each at the
  //! index of its body in the scene. `pairs` has the bounds of the bodies as they stand.
  double safe_share(CollisionPairs& pairs, const std::vector<Velocity>& velocities, double duration);

 private:
  struct SweptBody {
    const btCollisionObject* object;
    const CollisionShape* shape;
  };

  void make_pieces(CollisionPair& pair) const;

  std::vector<SweptBody> bodies_;
  std::vector<double> travels_;  // of the bodies' points, at most [m]
};

}  // namespace energymargin

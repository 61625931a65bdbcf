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
  //! `shapes` are those of the scene's bodies.
  explicit ContinuousCollision(const std::vector<CollisionShape>& shapes) : shapes_(shapes) {}

  //! The next pair of those in `CollisionPairs`, in the same order.
  void add(const btCollisionObject& a, const btCollisionObject& b);

  //! Forgets which directions separated bodies.
  void forget();

  //! The share, from 0 to 1, of the next `duration` [s] for which all bodies can go on with `velocities`, each at the
  //! index of its body in the scene. `pairs` has the bounds of the bodies as they stand.
  double safe_share(const CollisionPairs& pairs, const std::vector<Velocity>& velocities, double duration);

  //! Whether a rigid body is too deep in a link.
  bool is_squeezed(const CollisionPairs& pairs) const;

 private:
  struct BodyPair {
    const btCollisionObject *a, *b;
    std::vector<PiecePair> pieces{};  // none: behind a plane all is solid
  };

  std::vector<ConvexPiece> pieces(const btCollisionObject& object) const;

  const std::vector<CollisionShape>& shapes_;
  std::vector<BodyPair> pairs_;
  std::vector<double> reaches_;  // of the bodies' points from their origins [m]
  std::vector<double> travels_;  // of the bodies' points, at most [m]
};

}  // namespace energymargin

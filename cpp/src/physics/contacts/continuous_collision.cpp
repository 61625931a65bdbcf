#include "physics/contacts/continuous_collision.hpp"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// The base of a tree moves as a free body does.
bool is_link(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(&object);
  return link && link->m_link >= 0;
}

Sweep sweep(const btCollisionObject& body, const Velocity& velocity, double duration) {
  return {body.getWorldTransform(), velocity.linear * duration, velocity.angular * duration, is_link(body)};
}

}  // namespace

ContinuousCollision::ContinuousCollision(const Scene& scene, const std::vector<btCollisionObject*>& colliders) {
  for (std::size_t i = 0; i < colliders.size(); ++i) bodies_.push_back({colliders[i], &scene.collision_shape(i)});
}

void ContinuousCollision::make_pieces(CollisionPair& pair) const {
  for (const ConvexPiece& of_a : bodies_[pair.a].shape->pieces) {
    for (const ConvexPiece& of_b : bodies_[pair.b].shape->pieces) pair.pieces.emplace_back(of_a, of_b);
  }
}

double ContinuousCollision::safe_share(CollisionPairs& pairs, const std::vector<Velocity>& velocities,
                                       double duration) {
  travels_.resize(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Velocity& velocity = velocities[i];
    travels_[i] = duration * (velocity.linear.length() + velocity.angular.length() * bodies_[i].shape->reach);
  }
  double share = 1.0;
  for (CollisionPair& pair : pairs.within(travels_)) {
    const double motion = travels_[pair.a] + travels_[pair.b];
    if (!(pair.gap <= motion && std::isfinite(motion))) continue;  // a state will tell what is not finite
    if (pair.pieces.empty()) make_pieces(pair);
    if (pair.pieces.empty()) continue;
    const Sweep sweep_a = sweep(*bodies_[pair.a].object, velocities[pair.a], duration);
    const Sweep sweep_b = sweep(*bodies_[pair.b].object, velocities[pair.b], duration);
    for (PiecePair& pieces : pair.pieces) share *= pieces.safe_share(sweep_a.first(share), sweep_b.first(share));
  }
  return share;
}

}  // namespace energymargin

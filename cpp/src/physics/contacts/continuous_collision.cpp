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

// Of the core's points from the body's origin, or a little more.
double core_reach(const btConvexShape& shape, const btTransform& in_body) {
  btVector3 farthest(0, 0, 0);
  for (int axis = 0; axis < 3; ++axis) {
    btVector3 along(0, 0, 0);
    for (const double sign : {-1.0, 1.0}) {
      along[axis] = sign;
      const btVector3 local = along * in_body.getBasis();
      farthest[axis] =
          std::max(farthest[axis], along.dot(in_body(shape.localGetSupportVertexWithoutMarginNonVirtual(local))));
    }
  }
  return farthest.length();
}

std::vector<ConvexPiece> convex_pieces(const CollisionShape& of) {
  std::vector<ConvexPiece> pieces;
  for (std::size_t i = 0; i < of.half_extents.size(); ++i) {
    const bool part = of.shape->isCompound();
    const btCollisionShape& piece = part ? *of.parts[i] : *of.shape;
    const auto& shape = static_cast<const btConvexShape&>(piece);
    const btTransform in_body =
        part ? static_cast<const btCompoundShape&>(*of.shape).getChildTransform(int(i)) : btTransform::getIdentity();
    pieces.push_back({&shape, in_body, !part, core_reach(shape, in_body), of.half_extents[i]});
  }
  return pieces;
}

}  // namespace

ContinuousCollision::ContinuousCollision(const std::vector<CollisionShape>& shapes,
                                         const std::vector<btCollisionObject*>& colliders) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    SweptBody body{colliders[i], convex_pieces(shapes[i]), 0.0};
    for (const ConvexPiece& piece : body.pieces) body.reach = std::max(body.reach, piece.reach);
    bodies_.push_back(std::move(body));
  }
}

void ContinuousCollision::make_pieces(CollisionPair& pair) const {
  for (const ConvexPiece& of_a : bodies_[pair.a].pieces) {
    for (const ConvexPiece& of_b : bodies_[pair.b].pieces) pair.pieces.emplace_back(of_a, of_b);
  }
}

double ContinuousCollision::safe_share(CollisionPairs& pairs, const std::vector<Velocity>& velocities,
                                       double duration) {
  travels_.resize(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Velocity& velocity = velocities[i];
    travels_[i] = duration * (velocity.linear.length() + velocity.angular.length() * bodies_[i].reach);
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

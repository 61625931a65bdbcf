#include "physics/contacts/continuous_collision.hpp"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

bool is_rigid(const btCollisionObject& object) { return btRigidBody::upcast(&object) != nullptr; }

// The base of a tree moves as a free body does.
bool is_link(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(&object);
  return link && link->m_link >= 0;
}

// Bullet turns a rigid body by no more than it can in one motion.
Sweep sweep(const btCollisionObject& body, const Velocity& velocity, double duration) {
  const btVector3 turn = velocity.angular * duration;
  return {body.getWorldTransform(), velocity.linear * duration, is_rigid(body) ? integrated_turn(turn) : turn,
          is_link(body)};
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

}  // namespace

// None of a plane.
std::vector<ConvexPiece> ContinuousCollision::pieces(const btCollisionObject& object) const {
  const CollisionShape& of = shapes_[body_index(object)];
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

void ContinuousCollision::add(const btCollisionObject& a, const btCollisionObject& b) {
  BodyPair pair{&a, &b};
  reaches_.resize(shapes_.size(), 0.0);
  const auto reach_of = [this](const btCollisionObject& body) -> double& { return reaches_[body_index(body)]; };
  for (const ConvexPiece& of_a : pieces(a)) {
    reach_of(a) = std::max(reach_of(a), of_a.reach);
    for (const ConvexPiece& of_b : pieces(b)) {
      reach_of(b) = std::max(reach_of(b), of_b.reach);
      pair.pieces.emplace_back(of_a, of_b);
    }
  }
  pairs_.push_back(std::move(pair));
}

void ContinuousCollision::forget() {
  for (BodyPair& pair : pairs_) {
    for (PiecePair& pieces : pair.pieces) pieces.forget();
  }
}

bool ContinuousCollision::is_squeezed(const CollisionPairs& pairs) const {
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const BodyPair& pair = pairs_[i];
    const auto is_free = [](const btCollisionObject& object) { return is_rigid(object) && !object.isStaticObject(); };
    if (pairs.gap(i) > 0.0 || is_rigid(*pair.a) == is_rigid(*pair.b)) continue;
    if (!is_free(*pair.a) && !is_free(*pair.b)) continue;
    const btTransform& a = pair.a->getWorldTransform();
    const btTransform& b = pair.b->getWorldTransform();
    if (std::any_of(pair.pieces.begin(), pair.pieces.end(),
                    [&](const PiecePair& pieces) { return pieces.too_deep(a, b); })) {
      return true;
    }
  }
  return false;
}

double ContinuousCollision::safe_share(const CollisionPairs& pairs, const std::vector<Velocity>& velocities,
                                       double duration) {
  travels_.resize(reaches_.size());
  for (std::size_t i = 0; i < reaches_.size(); ++i) {
    const Velocity& velocity = velocities[i];
    travels_[i] = duration * (velocity.linear.length() + velocity.angular.length() * reaches_[i]);
  }
  double share = 1.0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    BodyPair& pair = pairs_[i];
    if (pair.pieces.empty()) continue;
    const double motion = travels_[body_index(*pair.a)] + travels_[body_index(*pair.b)];
    if (!(pairs.gap(i) <= motion && std::isfinite(motion))) continue;  // a state will tell what is not finite
    const Sweep sweep_a = sweep(*pair.a, velocities[body_index(*pair.a)], duration);
    const Sweep sweep_b = sweep(*pair.b, velocities[body_index(*pair.b)], duration);
    for (PiecePair& pieces : pair.pieces) share *= pieces.safe_share(sweep_a.first(share), sweep_b.first(share));
  }
  return share;
}

}  // namespace energymargin

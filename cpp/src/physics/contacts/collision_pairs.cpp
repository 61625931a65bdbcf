#include "physics/contacts/collision_pairs.hpp"

#include <algorithm>
#include <tuple>

#include "physics/contacts/found_contacts.hpp"

namespace energymargin {
namespace {

double reach_of_contact(const btCollisionObject& object) {
  return object.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold);
}

Bounds bounds_of(const btCollisionObject& object) {
  Bounds bounds;
  object.getCollisionShape()->getAabb(object.getWorldTransform(), bounds.low, bounds.high);
  return bounds;
}

bool precedes(const CollisionPair& pair, const CollisionPair& other) {
  return std::tie(pair.a, pair.b) < std::tie(other.a, other.b);
}

}  // namespace

CollisionPairs::CollisionPairs(btCollisionDispatcher& dispatcher, const CollisionFilter& can_collide,
                               const std::vector<btCollisionObject*>& colliders, std::size_t few)
    : dispatcher_(dispatcher), can_collide_(can_collide), colliders_(colliders), all_kept_(colliders.size() <= few) {
  for (const btCollisionObject* object : colliders_) {
    bounds_.push_back(bounds_of(*object));
    reaches_.push_back(reach_of_contact(*object));
  }
  if (!all_kept_) {
    found_.resize(colliders_.size() * colliders_.size());
    return;
  }
  for (std::size_t a = 0; a < colliders_.size(); ++a) {
    for (std::size_t b = a + 1; b < colliders_.size(); ++b) {
      if (can_collide_(a, b)) add(a, b);
    }
  }
}

void CollisionPairs::forget() {
  for (CollisionPair& pair : pairs_) {
    drop(pair);
    for (PiecePair& pieces : pair.pieces) pieces.forget();
  }
  points_.clear();
  if (all_kept_) return;
  pairs_.clear();
  std::fill(found_.begin(), found_.end(), false);
}

void CollisionPairs::update() {
  set_bounds();
  points_.clear();
  for (CollisionPair& pair : pairs_) {
    if (pair.gap <= pair.reach) {
      detect(pair);
    } else if (pair.algorithm) {
      drop(pair);
    }
  }
}

// Those of pairs found later too; `find` does their own.
void CollisionPairs::set_bounds() {
  for (std::size_t i = 0; i < colliders_.size(); ++i) {
    if (!colliders_[i]->isStaticObject()) bounds_[i] = bounds_of(*colliders_[i]);
  }
  for (CollisionPair& pair : pairs_) pair.gap = gap_of(bounds_[pair.a], bounds_[pair.b]);
  find(reaches_);
}

void CollisionPairs::find(const std::vector<double>& reaches) {
  if (all_kept_) return;
  const auto known = static_cast<std::ptrdiff_t>(pairs_.size());
  sweep_and_prune_(bounds_, reaches, [this](std::size_t a, std::size_t b) {
    const std::size_t number = a * colliders_.size() + b;
    if (found_[number]) return;
    found_[number] = true;
    if (can_collide_(a, b)) add(a, b);
  });
  std::sort(pairs_.begin() + known, pairs_.end(), precedes);
  std::inplace_merge(pairs_.begin(), pairs_.begin() + known, pairs_.end(), precedes);
}

void CollisionPairs::add(std::size_t a, std::size_t b) {
  pairs_.push_back(
      {a, b, std::min(reaches_[a], reaches_[b]), can_collide_.friction(a, b), gap_of(bounds_[a], bounds_[b])});
}

std::vector<CollisionPair>& CollisionPairs::within(const std::vector<double>& travels) {
  find(travels);
  return pairs_;
}

std::vector<std::pair<std::size_t, std::size_t>> CollisionPairs::near() {
  set_bounds();
  std::vector<std::pair<std::size_t, std::size_t>> bodies;
  for (const CollisionPair& pair : pairs_) {
    if (pair.gap <= pair.reach) bodies.emplace_back(pair.a, pair.b);
  }
  return bodies;
}

void CollisionPairs::detect(CollisionPair& pair) {
  btCollisionObject& a = *colliders_[pair.a];
  btCollisionObject& b = *colliders_[pair.b];
  const btCollisionObjectWrapper of_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper of_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
  if (!pair.algorithm) {
    pair.algorithm = dispatcher_.findAlgorithm(&of_a, &of_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  FoundContacts result(&of_a, &of_b, pair.friction, points_);
  pair.algorithm->processCollision(&of_a, &of_b, info_, &result);
}

void CollisionPairs::drop(CollisionPair& pair) {
  if (!pair.algorithm) return;
  pair.algorithm->~btCollisionAlgorithm();
  dispatcher_.freeCollisionAlgorithm(pair.algorithm);
  pair.algorithm = nullptr;
}

}  // namespace energymargin

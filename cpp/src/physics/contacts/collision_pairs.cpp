#include "physics/contacts/collision_pairs.hpp"

#include <algorithm>
#include <utility>

namespace energymargin {
namespace {

std::pair<int, int> indices(const btPersistentManifold& manifold) {
  return {manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex()};
}

double reach_of_contact(const btCollisionObject& object) {
  return object.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold);
}

void set_bounds(const btCollisionObject& object, btVector3& low, btVector3& high) {
  object.getCollisionShape()->getAabb(object.getWorldTransform(), low, high);
}

}  // namespace

std::size_t CollisionPairs::index_of(btCollisionObject& object) {
  const auto same = [&](const BoundedObject& other) { return other.object == &object; };
  const auto known = std::find_if(objects_.begin(), objects_.end(), same);
  if (known != objects_.end()) return static_cast<std::size_t>(known - objects_.begin());
  BoundedObject bounds{&object, !object.isStaticObject(), {}, {}};
  set_bounds(object, bounds.low, bounds.high);
  objects_.push_back(bounds);
  return objects_.size() - 1;
}

void CollisionPairs::add(btCollisionObject& a, btCollisionObject& b) {
  pairs_.push_back({index_of(a), index_of(b), std::min(reach_of_contact(a), reach_of_contact(b)), 0.0, nullptr});
}

void CollisionPairs::forget() {
  for (Pair& pair : pairs_) drop(pair);
  touching_.clear();
}

void CollisionPairs::update() {
  for (BoundedObject& body : objects_) {
    if (body.moves) set_bounds(*body.object, body.low, body.high);
  }
  touching_.clear();
  for (Pair& pair : pairs_) {
    pair.gap = gap_of(pair);
    if (pair.gap <= pair.reach) {
      detect(pair);
    } else if (pair.algorithm) {
      drop(pair);
    }
  }
  std::stable_sort(touching_.begin(), touching_.end(),
                   [](const auto* a, const auto* b) { return indices(*a) < indices(*b); });
}

double CollisionPairs::gap_of(const Pair& pair) const {
  const BoundedObject& a = objects_[pair.a];
  const BoundedObject& b = objects_[pair.b];
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

void CollisionPairs::detect(Pair& pair) {
  btCollisionObject& a = *objects_[pair.a].object;
  btCollisionObject& b = *objects_[pair.b].object;
  const btCollisionObjectWrapper of_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper of_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
  if (!pair.algorithm) {
    pair.algorithm = dispatcher_.findAlgorithm(&of_a, &of_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  btManifoldResult result(&of_a, &of_b);
  pair.algorithm->processCollision(&of_a, &of_b, info_, &result);
  manifolds_.resizeNoInitialize(0);
  pair.algorithm->getAllContactManifolds(manifolds_);
  for (int i = 0; i < manifolds_.size(); ++i) {
    if (manifolds_[i]->getNumContacts() > 0) touching_.push_back(manifolds_[i]);
  }
}

void CollisionPairs::drop(Pair& pair) {
  if (!pair.algorithm) return;
  pair.algorithm->~btCollisionAlgorithm();
  dispatcher_.freeCollisionAlgorithm(pair.algorithm);
  pair.algorithm = nullptr;
}

}  // namespace energymargin

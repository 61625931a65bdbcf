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

std::size_t CollisionPairs::bounded(btCollisionObject& object) {
  const auto same = [&](const Bounded& one) { return one.object == &object; };
  const auto found = std::find_if(bounded_.begin(), bounded_.end(), same);
  if (found != bounded_.end()) return static_cast<std::size_t>(found - bounded_.begin());
  Bounded made{&object, !object.isStaticObject(), {}, {}};
  set_bounds(object, made.low, made.high);
  bounded_.push_back(made);
  return bounded_.size() - 1;
}

void CollisionPairs::add(btCollisionObject& a, btCollisionObject& b) {
  pairs_.push_back({bounded(a), bounded(b), std::min(reach_of_contact(a), reach_of_contact(b)), 0.0, nullptr});
}

void CollisionPairs::forget() {
  for (Pair& pair : pairs_) drop(pair);
  touching_.clear();
}

void CollisionPairs::update() {
  for (Bounded& bounded : bounded_) {
    if (bounded.moves) set_bounds(*bounded.object, bounded.low, bounded.high);
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
  const Bounded& a = bounded_[pair.a];
  const Bounded& b = bounded_[pair.b];
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

void CollisionPairs::detect(Pair& pair) {
  btCollisionObject& a = *bounded_[pair.a].object;
  btCollisionObject& b = *bounded_[pair.b].object;
  const btCollisionObjectWrapper of_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper of_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
  if (!pair.algorithm) {
    pair.algorithm = dispatcher_.findAlgorithm(&of_a, &of_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  btManifoldResult result(&of_a, &of_b);
  pair.algorithm->processCollision(&of_a, &of_b, info_, &result);
  found_.resizeNoInitialize(0);
  pair.algorithm->getAllContactManifolds(found_);
  for (int i = 0; i < found_.size(); ++i) {
    if (found_[i]->getNumContacts() > 0) touching_.push_back(found_[i]);
  }
}

void CollisionPairs::drop(Pair& pair) {
  if (!pair.algorithm) return;
  pair.algorithm->~btCollisionAlgorithm();
  dispatcher_.freeCollisionAlgorithm(pair.algorithm);
  pair.algorithm = nullptr;
}

}  // namespace energymargin

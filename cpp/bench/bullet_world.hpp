#pragma once
// What it takes to put a scene's bodies into one of Bullet's own worlds, for comparison.

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "bullet_tree.hpp"
#include "physics/contacts/collision_filter.hpp"

namespace energymargin {

//! The scene's filter for Bullet's broadphase. The scene outlives this.
struct OverlapFilter : btOverlapFilterCallback {
  explicit OverlapFilter(const Scene& scene) : can_collide(scene) {}

  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const auto body = [](const btBroadphaseProxy& proxy) {
      return static_cast<std::size_t>(static_cast<btCollisionObject*>(proxy.m_clientObject)->getUserIndex());
    };
    return (a->m_collisionFilterGroup & b->m_collisionFilterMask) != 0 &&
           (b->m_collisionFilterGroup & a->m_collisionFilterMask) != 0 && can_collide(body(*a), body(*b));
  }

  CollisionFilter can_collide;
};

//! With the rows of its joints. The tree outlives the world.
inline void add_tree(btMultiBodyDynamicsWorld& world, BulletTree& tree) {
  for (const auto& collider : tree.colliders()) {
    world.addCollisionObject(collider.get(), btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  }
  world.addMultiBody(&tree.multi_body());
  for (const auto& joint : tree.joints()) world.addMultiBodyConstraint(joint.get());
}

}  // namespace energymargin

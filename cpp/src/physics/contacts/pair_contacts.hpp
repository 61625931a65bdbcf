#pragma once
// What this library's own contacts of two solids have in common.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! Room for one pair's contacts in a dispatcher's pool [bytes].
inline constexpr int contacts_size = 768;

inline const btConvexShape& convex_shape(const btCollisionObjectWrapper& object) {
  return static_cast<const btConvexShape&>(*object.getCollisionShape());
}

//! Knows which two bodies it is for. Its manifold says so, and holds no points.
class PairContacts : public btCollisionAlgorithm {
 public:
  PairContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& first,
               const btCollisionObjectWrapper& second)
      : btCollisionAlgorithm(info),
        manifold_(m_dispatcher->getNewManifold(first.getCollisionObject(), second.getCollisionObject())) {}

  ~PairContacts() override { m_dispatcher->releaseManifold(manifold_); }

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1.0;
  }

  void getAllContactManifolds(btManifoldArray& manifolds) override { manifolds.push_back(manifold_); }

 protected:
  btPersistentManifold* manifold_;
};

//! Makes them, in the dispatcher's pool.
template <typename Contacts>
struct CreateContacts : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    static_assert(sizeof(Contacts) <= contacts_size);
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Contacts));
    return new (memory) Contacts(info, *a, *b);
  }
};

}  // namespace energymargin

#include "physics/contacts/hull_contacts.hpp"

#include "physics/contacts/face_contacts.hpp"
#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

class Contacts : public PairContacts {
 public:
  Contacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
           const btCollisionObjectWrapper& b, bool with_faces)
      : PairContacts(info, a, b), solids_(convex_shape(a), convex_shape(b)), with_faces_(with_faces) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    result->setPersistentManifold(manifold_);
    const double threshold = manifold_->getContactBreakingThreshold();
    const double reach = threshold + result->m_closestPointDistanceThreshold;
    const btTransform& pose_a = a->getWorldTransform();
    const btTransform& pose_b = b->getWorldTransform();
    const btVector3 normal = solids_.add_closest(pose_a, pose_b, reach, *result);
    if (with_faces_ && !normal.isZero()) faces_.add(solids_, pose_a, pose_b, normal, threshold, reach, *result);
    result->refreshContactPoints();
  }

 private:
  SolidPair solids_;
  FaceContacts faces_;
  bool with_faces_;
};

}  // namespace

btCollisionAlgorithm* HullContacts::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                             const btCollisionObjectWrapper* a,
                                                             const btCollisionObjectWrapper* b) {
  static_assert(sizeof(Contacts) <= contacts_size);
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Contacts));
  return new (memory) Contacts(info, *a, *b, with_faces);
}

void HullContacts::use_in(btCollisionDispatcher& dispatcher) {
  const int hull = CONVEX_HULL_SHAPE_PROXYTYPE, cylinder = CYLINDER_SHAPE_PROXYTYPE, box = BOX_SHAPE_PROXYTYPE;
  for (const int other :
       {hull, cylinder, box, static_cast<int>(CAPSULE_SHAPE_PROXYTYPE), static_cast<int>(SPHERE_SHAPE_PROXYTYPE)}) {
    dispatcher.registerCollisionCreateFunc(hull, other, this);
    dispatcher.registerCollisionCreateFunc(other, hull, this);
  }
}

}  // namespace energymargin

#include "box_contacts.hpp"

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>
#include <btBulletDynamicsCommon.h>

namespace energymargin {
namespace {

// Points this far apart are contacts too, as a share of Bullet's reach of a contact; their distance stays what it is.
constexpr double hair = 1e-3;

// How far a box that grows by 1 on each side reaches further along a direction.
double growth(const btTransform& pose, const btVector3& direction) {
  const btVector3 inside = (direction * pose.getBasis()).absolute();
  return inside.x() + inside.y() + inside.z();
}

// Moves the points of two grown boxes back to where the boxes are.
struct Shrunk : btDiscreteCollisionDetectorInterface::Result {
  btManifoldResult& to;
  const btTransform& a;
  const btTransform& b;
  double grown;

  Shrunk(btManifoldResult& to_, const btTransform& a_, const btTransform& b_, double grown_)
      : to(to_), a(a_), b(b_), grown(grown_) {}

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    const double of_a = grown * growth(a, normal);
    const double of_b = grown * growth(b, normal);
    to.addContactPoint(normal, on_b - normal * of_b, distance + of_a + of_b);
  }
};

class BoxContacts : public btCollisionAlgorithm {
 public:
  BoxContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
              const btCollisionObjectWrapper* b)
      : btCollisionAlgorithm(info),
        manifold_(m_dispatcher->getNewManifold(a->getCollisionObject(), b->getCollisionObject())) {}

  ~BoxContacts() override { m_dispatcher->releaseManifold(manifold_); }

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    const btVector3 half_a = static_cast<const btBoxShape*>(a->getCollisionShape())->getHalfExtentsWithMargin();
    const btVector3 half_b = static_cast<const btBoxShape*>(b->getCollisionShape())->getHalfExtentsWithMargin();
    const double grown = hair * manifold_->getContactBreakingThreshold();
    const btVector3 more(grown, grown, grown);
    const btBoxShape box_a(half_a + more);
    const btBoxShape box_b(half_b + more);
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = a->getWorldTransform();
    input.m_transformB = b->getWorldTransform();
    result->setPersistentManifold(manifold_);
    Shrunk points(*result, input.m_transformA, input.m_transformB, grown);
    btBoxBoxDetector(&box_a, &box_b).getClosestPoints(input, points, nullptr);
    result->refreshContactPoints();
  }

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1.0;
  }

  void getAllContactManifolds(btManifoldArray& manifolds) override { manifolds.push_back(manifold_); }

 private:
  btPersistentManifold* manifold_;
};

struct CreateBoxContacts : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(BoxContacts));
    return new (memory) BoxContacts(info, a, b);
  }
};

}  // namespace

void use_box_contacts(btCollisionDispatcher& dispatcher) {
  static CreateBoxContacts create;
  dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &create);
}

}  // namespace energymargin

#include "physics/contacts/box_contacts.hpp"

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>

#include "physics/contacts/pair_contacts.hpp"

namespace energymargin {
namespace {

// Points this far apart are contacts too, as a share of Bullet's reach of a contact; their distance stays what it is.
constexpr double hair = 1e-3;

// How much further a box reaches along a direction if it is inflated by 1 on each side.
double reach_per_inflation(const btTransform& pose, const btVector3& direction) {
  const btVector3 inside = (direction * pose.getBasis()).absolute();
  return inside.x() + inside.y() + inside.z();
}

// Moves the points of two inflated boxes back to the boxes.
struct DeflatedPoints : btDiscreteCollisionDetectorInterface::Result {
  btManifoldResult& to;
  const btTransform& a;
  const btTransform& b;
  double inflation;

  DeflatedPoints(btManifoldResult& to_, const btTransform& a_, const btTransform& b_, double inflation_)
      : to(to_), a(a_), b(b_), inflation(inflation_) {}

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    const double of_a = inflation * reach_per_inflation(a, normal);
    const double of_b = inflation * reach_per_inflation(b, normal);
    to.addContactPoint(normal, on_b - normal * of_b, distance + of_a + of_b);
  }
};

class BoxContacts : public PairContacts {
 public:
  BoxContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
              const btCollisionObjectWrapper& b)
      : PairContacts(info, a, b),
        inflation_(hair * manifold_->getContactBreakingThreshold()),
        a_(inflated_box(a)),
        b_(inflated_box(b)) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = a->getWorldTransform();
    input.m_transformB = b->getWorldTransform();
    result->setPersistentManifold(manifold_);
    DeflatedPoints points(*result, input.m_transformA, input.m_transformB, inflation_);
    btBoxBoxDetector(&a_, &b_).getClosestPoints(input, points, nullptr);
    result->refreshContactPoints();
  }

 private:
  btBoxShape inflated_box(const btCollisionObjectWrapper& object) const {
    const auto& box = static_cast<const btBoxShape&>(*object.getCollisionShape());
    return btBoxShape(box.getHalfExtentsWithMargin() + btVector3(inflation_, inflation_, inflation_));
  }

  double inflation_;
  btBoxShape a_, b_;
};

}  // namespace

void use_box_contacts(btCollisionDispatcher& dispatcher) {
  static CreateContacts<BoxContacts> create;
  dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &create);
}

}  // namespace energymargin

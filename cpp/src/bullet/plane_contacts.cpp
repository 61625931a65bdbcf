#include "plane_contacts.hpp"

#include <btBulletCollisionCommon.h>

namespace energymargin {
namespace {

// Calls `visit` with every point of a solid, in its own frame, that can be its lowest one. `down` is a direction in
// that frame.
template <typename Visit>
void for_each_low_point(const btCollisionShape& shape, const btVector3& down, const Visit& visit) {
  const auto ends = [&](const btVector3& half, const btVector3& side) {
    visit(side + half);
    visit(side - half);
  };
  switch (shape.getShapeType()) {
    case BOX_SHAPE_PROXYTYPE: {
      const btVector3 half = static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin();
      for (int corner = 0; corner < 8; ++corner) {
        visit(btVector3(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                        corner & 4 ? half.z() : -half.z()));
      }
      return;
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      // On each rim the lowest point and those a quarter and half a turn from it: a firm stand, and a smooth roll.
      const btVector3 half = static_cast<const btCylinderShape&>(shape).getHalfExtentsWithMargin();
      btVector3 low(down.x(), down.y(), 0.0);
      low = low.length2() > 1e-18 ? low.normalized() * half.x() : btVector3(half.x(), 0.0, 0.0);
      const btVector3 across(-low.y(), low.x(), 0.0);
      const btVector3 end(0.0, 0.0, half.z());
      for (const btVector3& side : {low, -low, across, -across}) ends(end, side);
      return;
    }
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      ends(btVector3(0.0, 0.0, capsule.getHalfHeight()), down * capsule.getRadius());
      return;
    }
    case SPHERE_SHAPE_PROXYTYPE: {
      visit(down * static_cast<const btSphereShape&>(shape).getRadius());
      return;
    }
    default: {
      const auto& hull = static_cast<const btConvexHullShape&>(shape);
      for (int i = 0; i < hull.getNumPoints(); ++i) visit(hull.getScaledPoint(i) + down * hull.getMargin());
    }
  }
}

class PlaneContacts : public btCollisionAlgorithm {
 public:
  PlaneContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* solid,
                const btCollisionObjectWrapper* plane)
      : btCollisionAlgorithm(info),
        manifold_(m_dispatcher->getNewManifold(solid->getCollisionObject(), plane->getCollisionObject())) {}

  ~PlaneContacts() override { m_dispatcher->releaseManifold(manifold_); }

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    const bool solid_first = b->getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
    const btCollisionObjectWrapper* solid = solid_first ? a : b;
    const btCollisionObjectWrapper* ground = solid_first ? b : a;
    const auto& plane = static_cast<const btStaticPlaneShape&>(*ground->getCollisionShape());
    const btVector3 normal = ground->getWorldTransform().getBasis() * plane.getPlaneNormal();
    const double offset = plane.getPlaneConstant() + normal.dot(ground->getWorldTransform().getOrigin());
    const double reach = manifold_->getContactBreakingThreshold() + result->m_closestPointDistanceThreshold;
    result->setPersistentManifold(manifold_);
    const btTransform& pose = solid->getWorldTransform();
    for_each_low_point(*solid->getCollisionShape(), -normal * pose.getBasis(), [&](const btVector3& point) {
      const btVector3 on_solid = pose * point;
      const double distance = normal.dot(on_solid) - offset;
      if (distance >= reach) return;
      // The result takes a point of its second body and a normal from there to the first.
      if (solid_first) {
        result->addContactPoint(normal, on_solid - normal * distance, distance);
      } else {
        result->addContactPoint(-normal, on_solid, distance);
      }
    });
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

struct CreatePlaneContacts : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PlaneContacts));
    return new (memory) PlaneContacts(info, a, b);
  }
};

}  // namespace

void use_plane_contacts(btCollisionDispatcher& dispatcher) {
  static CreatePlaneContacts create;
  for (const int solid : {BOX_SHAPE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE, CAPSULE_SHAPE_PROXYTYPE,
                          SPHERE_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE}) {
    for (auto registering : {&btCollisionDispatcher::registerCollisionCreateFunc,
                             &btCollisionDispatcher::registerClosestPointsCreateFunc}) {
      (dispatcher.*registering)(solid, STATIC_PLANE_PROXYTYPE, &create);
      (dispatcher.*registering)(STATIC_PLANE_PROXYTYPE, solid, &create);
    }
  }
}

}  // namespace energymargin

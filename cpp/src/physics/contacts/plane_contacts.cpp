#include "physics/contacts/plane_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "physics/contacts/face_contacts.hpp"
#include "physics/contacts/found_contacts.hpp"
#include "physics/contacts/hull_shape.hpp"
#include "physics/contacts/pair_contacts.hpp"

namespace energymargin {
namespace {

// A cylinder stands upright if its axis is as near to the vertical: square of the sine. Then its points stay where they
// are, and its lowest one is a thousandth of the radius below them at most.
constexpr double upright = 1e-6;

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
      low = low.length2() > upright ? low.normalized() * half.x() : btVector3(half.x(), 0.0, 0.0);
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
      for (const btVector3& corner : static_cast<const HullShape&>(shape).corners()) visit(corner);
    }
  }
}

bool is_hull(const btCollisionShape& shape) { return shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE; }

// Half way from a solid's top to its lowest point, along `down`. A hull may have its frame anywhere.
double half_way(const btCollisionShape& shape, const btVector3& down) {
  if (!is_hull(shape)) return 0.0;
  double top = BT_LARGE_FLOAT;
  double low = -BT_LARGE_FLOAT;
  for_each_low_point(shape, down, [&](const btVector3& point) {
    top = std::min(top, down.dot(point));
    low = std::max(low, down.dot(point));
  });
  return 0.5 * (top + low);
}

// Whether it is a cylinder on its round face.
bool stands(const btCollisionShape& shape, const btVector3& down) {
  return shape.getShapeType() == CYLINDER_SHAPE_PROXYTYPE && down.x() * down.x() + down.y() * down.y() <= upright;
}

bool is_plane(const btCollisionObjectWrapper& object) {
  return object.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
}

// The solid always comes first.
class PlaneContacts : public PairContacts {
 public:
  PlaneContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
                const btCollisionObjectWrapper& b)
      : PairContacts(info, is_plane(b) ? a : b, is_plane(b) ? b : a) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    const btCollisionObjectWrapper& solid = is_plane(*b) ? *a : *b;
    const btCollisionObjectWrapper& ground = is_plane(*b) ? *b : *a;
    const auto& plane = static_cast<const btStaticPlaneShape&>(*ground.getCollisionShape());
    const btVector3 normal = ground.getWorldTransform().getBasis() * plane.getPlaneNormal();
    const double offset = plane.getPlaneConstant() + normal.dot(ground.getWorldTransform().getOrigin());
    const double reach = manifold_->getContactBreakingThreshold() + result->m_closestPointDistanceThreshold;
    result->setPersistentManifold(manifold_);
    const btTransform& pose = solid.getWorldTransform();
    const btVector3 down = -normal * pose.getBasis();
    const btCollisionShape& shape = *solid.getCollisionShape();
    auto* const found = stands(shape, down) ? dynamic_cast<FoundContacts*>(result) : nullptr;
    const double middle = half_way(shape, down);
    for_each_low_point(shape, down, [&](const btVector3& point) {
      if (down.dot(point) < middle) return;  // the top of a thin body is in reach too, and must not carry it
      const btVector3 on_solid = pose * point;
      const double distance = normal.dot(on_solid) - offset;
      if (distance >= reach) return;
      const btVector3 on_ground = on_solid - normal * distance;
      if (!found) return result->addContactPoint(normal, on_ground, distance);
      const btVector3 grip = pose * btVector3(grip_share * point.x(), grip_share * point.y(), point.z());
      found->add(normal, on_ground, distance, grip - normal * distance);
    });
  }
};

}  // namespace

void use_plane_contacts(btCollisionDispatcher& dispatcher) {
  static CreateContacts<PlaneContacts> create;
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

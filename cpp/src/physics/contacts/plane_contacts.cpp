#include "physics/contacts/plane_contacts.hpp"

#include <algorithm>
#include <cmath>

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
      const auto& hull = static_cast<const btConvexHullShape&>(shape);
      for (int i = 0; i < hull.getNumPoints(); ++i) visit(hull.getScaledPoint(i) + down * hull.getMargin());
    }
  }
}

// The support points of a hull on a plane, at most four, which is what Bullet keeps: the ends of its longest way along
// one direction and the outermost points to both sides of that; and the lowest point, in place of the nearest of these.
// Of more points at one height, rounding errors would say which are kept.
class SupportPoints {
 public:
  // `reach`: of a contact [m].
  SupportPoints(const btVector3& down, double reach)
      : down_(down), tie_(tie_share * reach), depth_(depth_share * reach) {
    const btVector3 axis = std::abs(down.x()) < steep_x ? btVector3(1.0, 0.0, 0.0) : btVector3(0.0, 1.0, 0.0);
    const btVector3 first = (axis - down * down.dot(axis)).normalized();
    along_ = first * std::cos(off_axis) + down.cross(first) * std::sin(off_axis);
  }

  void add(const btVector3& point) { points_.push_back(point); }

  template <typename Visit>
  void for_each(const Visit& visit) const {
    if (points_.size() == 0) return;
    const btVector3& front = farthest(along_);
    const btVector3& back = farthest(-along_);
    const btVector3 across = down_.cross(front - back).normalized();
    btVector3 support[] = {front, back, farthest(across), farthest(-across)};
    include_lowest(support);
    for (int i = 0; i < 4; ++i) {
      if (std::find(support, support + i, support[i]) == support + i) visit(support[i]);
    }
  }

 private:
  // Shares of the reach. Two points are equally far if they differ by less than the first, which is far above
  // rounding errors. The lowest point replaces another where it is deeper by the second: a corner that is
  // less deep hardly carries anything.
  static constexpr double tie_share = 1e-3;
  static constexpr double depth_share = 0.01;

  // The first direction is off the axis by an angle that is no simple part of a turn [rad]: along the axis, to which
  // many hulls have an edge at right angles, both ends of that edge would be outermost.
  static constexpr double off_axis = 0.46;

  // Above this |x| of `down`, which is about cos 45 degrees, the y axis replaces the x axis.
  static constexpr double steep_x = 0.7;

  // The first of those that are farthest along a direction.
  const btVector3& farthest(const btVector3& direction) const {
    int best = 0;
    for (int i = 1; i < points_.size(); ++i) {
      if (direction.dot(points_[i]) > direction.dot(points_[best]) + tie_) best = i;
    }
    return points_[best];
  }

  void include_lowest(btVector3 (&support)[4]) const {
    const btVector3& lowest = farthest(down_);
    const auto higher = [&](const btVector3& a, const btVector3& b) { return down_.dot(a) < down_.dot(b); };
    if (!(down_.dot(lowest) > down_.dot(*std::max_element(support, support + 4, higher)) + depth_)) return;
    const auto nearer = [&](const btVector3& a, const btVector3& b) {
      return a.distance2(lowest) < b.distance2(lowest);
    };
    *std::min_element(support, support + 4, nearer) = lowest;
  }

  btVector3 down_, along_;
  double tie_, depth_;  // [m]
  btAlignedObjectArray<btVector3> points_;
};

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

bool is_plane(const btCollisionObjectWrapper& object) {
  return object.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
}

// The solid always comes first: Bullet finds a point of the last step again by its place in the first body's frame, and
// there a point of the solid stays where it is while the solid slides.
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
    const bool fresh = manifold_->getNumContacts() == 0;
    result->setPersistentManifold(manifold_);
    const btTransform& pose = solid.getWorldTransform();
    const btVector3 down = -normal * pose.getBasis();
    const double middle = half_way(*solid.getCollisionShape(), down);
    const auto add = [&](const btVector3& point) {
      const btVector3 on_solid = pose * point;
      const double distance = normal.dot(on_solid) - offset;
      result->addContactPoint(normal, on_solid - normal * distance, distance);
    };
    const auto for_each_in_reach = [&](const auto& visit) {
      for_each_low_point(*solid.getCollisionShape(), down, [&](const btVector3& point) {
        if (down.dot(point) < middle) return;  // the top of a thin body is in reach too, and must not carry it
        if (normal.dot(pose * point) - offset < reach) visit(point);
      });
    };
    // Who asks how far it is to the ground asks for the lowest point of all.
    if (is_hull(*solid.getCollisionShape()) && result->m_closestPointDistanceThreshold == 0.0) {
      SupportPoints support(down, reach);
      for_each_in_reach([&](const btVector3& point) { support.add(point); });
      support.for_each(add);
    } else {
      for_each_in_reach(add);
    }
    result->refreshContactPoints();
    if (fresh) share_load(*solid.getCollisionObject(), normal);
  }

 private:
  // The solver starts from an even share of the load. A body that cannot tilt leaves the shares open, and a solver that
  // starts from nothing would stand it on its first corner.
  void share_load(const btCollisionObject& solid, const btVector3& normal) {
    const btRigidBody* body = btRigidBody::upcast(&solid);
    if (!body || body->getInvMass() == 0.0 || body->getCollisionShape()->isCompound()) return;
    const double approach = -normal.dot(body->getLinearVelocity());
    if (approach <= 0.0) return;
    const int count = manifold_->getNumContacts();
    for (int i = 0; i < count; ++i) {
      manifold_->getContactPoint(i).m_appliedImpulse = approach / body->getInvMass() / count;
    }
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

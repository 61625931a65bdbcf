#include "physics/contacts/hull_contacts.hpp"

#include "physics/contacts/gjk.hpp"
#include "physics/contacts/pair_contacts.hpp"

namespace energymargin {
namespace {

constexpr double tilt = 0.02;  // rad: a face's corners are then apart by a fiftieth of its size, which GJK can tell
constexpr double lying = 0.7;  // sine of the angle between a round solid's axis and the normal
constexpr int points_of_a_face = 4;  // with so many, a hull stands: no more are looked for

// Points of a tilted body, put where they are on the body as it is.
class TiltCorrection : public GjkResult {
 public:
  TiltCorrection(btManifoldResult& result, const btTransform& back, bool of_a)
      : result_(result), back_(back), of_a_(of_a) {}

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar depth) override {
    const btVector3 on_a = on_b + normal * depth;
    if (of_a_) {
      const btVector3 end = back_ * on_a;
      const double true_depth = (end - on_b).dot(normal);
      result_.addContactPoint(normal, end - normal * true_depth, true_depth);
    } else {
      const btVector3 start = back_ * on_b;
      result_.addContactPoint(normal, start, (on_a - start).dot(normal));
    }
  }

 private:
  btManifoldResult& result_;
  btTransform back_;
  bool of_a_;
};

class Contacts : public PairContacts {
 public:
  Contacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
           const btCollisionObjectWrapper& b, bool tilted)
      : PairContacts(info, a, b), tilted_(tilted) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    result->setPersistentManifold(manifold_);
    const double reach = shape(*a).getMargin() + shape(*b).getMargin() + manifold_->getContactBreakingThreshold() +
                         result->m_closestPointDistanceThreshold;
    GjkInput input;
    input.m_transformA = a->getWorldTransform();
    input.m_transformB = b->getWorldTransform();
    input.m_maximumDistanceSquared = reach * reach;
    const btVector3 axis = closest_points(shape(*a), shape(*b), input, *result);
    const bool flat = !is_ball(shape(*a)) && !is_ball(shape(*b));
    if (tilted_ && flat && manifold_->getNumContacts() < points_of_a_face && axis.length2() > SIMD_EPSILON) {
      add_tilted(input, shape(*a), shape(*b), axis.normalized(), *result);
    }
    result->refreshContactPoints();
  }

 private:
  static const btConvexShape& shape(const btCollisionObjectWrapper& object) {
    return static_cast<const btConvexShape&>(*object.getCollisionShape());
  }

  // The smaller body is tilted about axes in the plane of contact.
  static void add_tilted(const GjkInput& input, const btConvexShape& a, const btConvexShape& b, const btVector3& normal,
                         btManifoldResult& result) {
    const bool of_a = a.getAngularMotionDisc() < b.getAngularMotionDisc();
    const btTransform& body = of_a ? input.m_transformA : input.m_transformB;
    const auto add = [&](const btVector3& axis, double angle) {
      GjkInput tilted = input;
      btTransform& turned = of_a ? tilted.m_transformA : tilted.m_transformB;
      turned.setBasis(btMatrix3x3(btQuaternion(axis, angle)) * body.getBasis());
      TiltCorrection correction(result, body * turned.inverse(), of_a);
      closest_points(a, b, tilted, correction);
    };
    if (is_round(a) || is_round(b)) {
      const btTransform& round = is_round(a) ? input.m_transformA : input.m_transformB;
      const btVector3 across = normal.cross(round.getBasis().getColumn(2));
      // On its side it touches with a line: where else it is tilted it rolls, and the point is off that line.
      if (across.length() > lying) {
        for (const double angle : {tilt, -tilt}) add(across.normalized(), angle);
        return;
      }
      if (is_capsule(a) || is_capsule(b)) return;
    }
    btVector3 first, second;
    btPlaneSpace1(normal, first, second);
    for (const btVector3& axis : {first, second, -first, -second}) add(axis, tilt);
  }

  static bool is_capsule(const btConvexShape& shape) { return shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE; }
  static bool is_ball(const btConvexShape& shape) { return shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE; }
  static bool is_round(const btConvexShape& shape) {
    return shape.getShapeType() == CYLINDER_SHAPE_PROXYTYPE || is_capsule(shape);
  }

  bool tilted_;
};

}  // namespace

btCollisionAlgorithm* HullContacts::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                             const btCollisionObjectWrapper* a,
                                                             const btCollisionObjectWrapper* b) {
  static_assert(sizeof(Contacts) <= contacts_size);
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Contacts));
  return new (memory) Contacts(info, *a, *b, tilted);
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

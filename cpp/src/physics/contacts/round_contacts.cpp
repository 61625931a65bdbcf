#include "physics/contacts/round_contacts.hpp"

#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include "physics/contacts/gjk.hpp"
#include "physics/contacts/pair_contacts.hpp"

namespace energymargin {
namespace {

constexpr double no_closer = 1e-12;     // share of a squared distance, below which a step is none
constexpr int most_rounds = 1000;       // as Bullet's own, which it then asks
constexpr double clearly_apart = 1e-5;  // of the cores [m]; below it Bullet is asked

// A solid without its margin.
class Core {
 public:
  explicit Core(const btConvexShape& shape)
      : kind_(shape.getShapeType()),
        half_(static_cast<const btConvexInternalShape&>(shape).getImplicitShapeDimensions()) {}

  // Its farthest point along a direction, both in its own frame.
  btVector3 support(const btVector3& direction) const {
    const double end = direction.z() < 0.0 ? -half_.z() : half_.z();
    switch (kind_) {
      case BOX_SHAPE_PROXYTYPE:
        return {direction.x() >= 0.0 ? half_.x() : -half_.x(), direction.y() >= 0.0 ? half_.y() : -half_.y(),
                direction.z() >= 0.0 ? half_.z() : -half_.z()};
      case CYLINDER_SHAPE_PROXYTYPE: {
        const double across = btSqrt(direction.x() * direction.x() + direction.y() * direction.y());
        if (across == 0.0) return {half_.x(), 0.0, end};
        const double scale = half_.x() / across;
        return {direction.x() * scale, direction.y() * scale, end};
      }
      case CAPSULE_SHAPE_PROXYTYPE:
        return {0.0, 0.0, end};
      default:  // sphere
        return {0.0, 0.0, 0.0};
    }
  }

 private:
  int kind_;
  btVector3 half_;
};

struct Closest {
  btVector3 axis;   // from b to a
  btVector3 on_b;   // of b's core
  double distance;  // of the cores [m]
};

// GJK, as Bullet does it: false if the cores are not clearly apart, or if that is not known after `most_rounds`.
bool find_closest(const Core& a, const Core& b, const GjkInput& input, Closest& closest) {
  btVoronoiSimplexSolver simplex;
  simplex.reset();
  btVector3& axis = closest.axis;
  axis.setValue(0.0, 1.0, 0.0);
  double squared = BT_LARGE_FLOAT;
  for (int round = 0;; ++round) {
    if (round == most_rounds) return false;
    const btVector3 on_a = input.m_transformA(a.support(-axis * input.m_transformA.getBasis()));
    const btVector3 on_b = input.m_transformB(b.support(axis * input.m_transformB.getBasis()));
    const btVector3 difference = on_a - on_b;
    const double bound = axis.dot(difference);
    if (bound > 0.0 && bound * bound > squared * input.m_maximumDistanceSquared) break;  // out of reach
    if (simplex.inSimplex(difference) || squared - bound <= squared * no_closer) break;
    simplex.addVertex(difference, on_a, on_b);
    btVector3 next;
    if (!simplex.closest(next)) break;
    if (next.length2() < clearly_apart * clearly_apart) return false;
    const double before = squared;
    squared = next.length2();
    if (before - squared <= SIMD_EPSILON * before) break;
    axis = next;
    if (simplex.fullSimplex()) return false;
  }
  btVector3 on_a;
  simplex.compute_points(on_a, closest.on_b);
  closest.distance = btSqrt(squared);
  return squared < BT_LARGE_FLOAT;
}

class RoundContacts : public PairContacts {
 public:
  RoundContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
                const btCollisionObjectWrapper& b)
      : PairContacts(info, a, b), a_(shape(a)), b_(shape(b)) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    result->setPersistentManifold(manifold_);
    const double margins = shape(*a).getMargin() + shape(*b).getMargin();
    const double reach = margins + manifold_->getContactBreakingThreshold() + result->m_closestPointDistanceThreshold;
    GjkInput input;
    input.m_transformA = a->getWorldTransform();
    input.m_transformB = b->getWorldTransform();
    input.m_maximumDistanceSquared = reach * reach;
    if (!add_apart(input, shape(*b).getMargin(), margins, *result))
      closest_points(shape(*a), shape(*b), input, *result);
    result->refreshContactPoints();
  }

 private:
  static const btConvexShape& shape(const btCollisionObjectWrapper& object) {
    return static_cast<const btConvexShape&>(*object.getCollisionShape());
  }

  bool add_apart(GjkInput input, double margin_b, double margins, btManifoldResult& result) const {
    const btVector3 middle = (input.m_transformA.getOrigin() + input.m_transformB.getOrigin()) * 0.5;
    input.m_transformA.getOrigin() -= middle;
    input.m_transformB.getOrigin() -= middle;
    Closest closest;
    if (!find_closest(a_, b_, input, closest)) return false;
    const double scale = 1.0 / btSqrt(closest.axis.length2());
    const double distance = 1.0 / scale - margins;
    if (distance >= 0.0 && distance * distance >= input.m_maximumDistanceSquared) return true;
    const btVector3 on_b = closest.on_b + closest.axis * (margin_b / closest.distance);
    result.addContactPoint(closest.axis * scale, on_b + middle, distance);
    return true;
  }

  Core a_, b_;
};

}  // namespace

void use_round_contacts(btCollisionDispatcher& dispatcher) {
  static CreateContacts<RoundContacts> create;
  const auto both_ways = [&](int a, int b) {
    dispatcher.registerCollisionCreateFunc(a, b, &create);
    dispatcher.registerCollisionCreateFunc(b, a, &create);
  };
  // Bullet has better for two spheres or capsules.
  for (const int round : {CYLINDER_SHAPE_PROXYTYPE, CAPSULE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE}) {
    both_ways(round, BOX_SHAPE_PROXYTYPE);
    both_ways(round, CYLINDER_SHAPE_PROXYTYPE);
  }
}

}  // namespace energymargin

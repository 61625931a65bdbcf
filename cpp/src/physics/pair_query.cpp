#include "physics/pair_query.hpp"

#include "physics/shapes.hpp"

namespace energymargin {
namespace {

struct LeastDistance : btCollisionWorld::ContactResultCallback {
  const btCollisionObject* first;
  ClosestPoints points;

  LeastDistance(const btCollisionObject& a, double reach) : first(&a) { m_closestDistanceThreshold = reach; }

  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    if (!(point.getDistance() < points.distance)) return 0.0;
    const bool swapped = a->getCollisionObject() != first;
    points.distance = point.getDistance();
    points.position = from_bullet(swapped ? point.getPositionWorldOnA() : point.getPositionWorldOnB());
    points.normal = (swapped ? -1.0 : 1.0) * from_bullet(point.m_normalWorldOnB);
    return 0.0;
  }
};

}  // namespace

ClosestPoints PairQuery::operator()(btCollisionObject& first, btCollisionObject& second, double reach) {
  LeastDistance least(first, reach);
  const ContactDispatcher::SinglePoints single(dispatcher_);
  world_.contactPairTest(&first, &second, least);
  return least.points;
}

}  // namespace energymargin

#include "physics/contacts/solid_pair.hpp"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

namespace energymargin {
namespace {

struct OnePoint : btDiscreteCollisionDetectorInterface::Result {
  std::optional<ClosestPoints> point;

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    point = {normal, on_b, distance};
  }
};

}  // namespace

std::optional<ClosestPoints> SolidPair::closest(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                                Penetration penetration) {
  ClosestPoints inner;
  const Separation separation = inner_distance(pose_a, pose_b, margins() + reach, inner);
  if (separation == Separation::too_far) return std::nullopt;
  if (separation == Separation::too_near) return closest_by_bullet(pose_a, pose_b, reach, penetration);
  return ClosestPoints{inner.normal, inner.on_b + inner.normal * b_.margin(), inner.distance - margins()};
}

std::optional<ClosestPoints> SolidPair::closest_by_bullet(const btTransform& pose_a, const btTransform& pose_b,
                                                          double reach, Penetration penetration) const {
  btDiscreteCollisionDetectorInterface::ClosestPointInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  input.m_maximumDistanceSquared = (margins() + reach) * (margins() + reach);
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver depth;
  btGjkPairDetector detector(&shape_a_, &shape_b_, &simplex, penetration == Penetration::measured ? &depth : nullptr);
  OnePoint result;
  detector.getClosestPoints(input, result, nullptr);
  return result.point;
}

}  // namespace energymargin

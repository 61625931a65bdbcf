#include "physics/contacts/gjk.hpp"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

namespace energymargin {

void closest_points(const btConvexShape& a, const btConvexShape& b, const GjkInput& input, GjkResult& result,
                    Overlap overlap) {
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver penetration;
  btGjkPairDetector detector(&a, &b, &simplex, overlap == Overlap::measured ? &penetration : nullptr);
  detector.getClosestPoints(input, result, nullptr);
}

btPointCollector closest_points(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                                const btTransform& pose_b, Overlap overlap) {
  GjkInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  btPointCollector closest;
  closest_points(a, b, input, closest, overlap);
  return closest;
}

}  // namespace energymargin

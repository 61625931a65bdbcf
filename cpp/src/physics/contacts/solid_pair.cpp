#include "physics/contacts/solid_pair.hpp"

namespace energymargin {

btVector3 SolidPair::add_closest(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                 GjkResult& result) {
  const double margins = margin_a() + margin_b();
  CoreDistance closest;
  const Cores found = cores_.distance(pose_a, pose_b, margins + reach, closest);
  if (found == Cores::too_far) return {0.0, 0.0, 0.0};
  if (found == Cores::apart) {
    result.addContactPoint(closest.normal, closest.on_b + closest.normal * margin_b(), closest.distance - margins);
    return closest.normal;
  }
  GjkInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  input.m_maximumDistanceSquared = (margins + reach) * (margins + reach);
  const btVector3 axis = closest_points(a_, b_, input, result);
  return axis.length2() > SIMD_EPSILON ? axis.normalized() : btVector3(0.0, 0.0, 0.0);
}

}  // namespace energymargin

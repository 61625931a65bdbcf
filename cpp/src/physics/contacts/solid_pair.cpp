#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

// Remembers the normal of the point that it passes on. Bullet may turn it round after it has separated the solids along
// the axis that it returns.
struct WithNormal : GjkResult {
  GjkResult& to;
  btVector3 normal{0.0, 0.0, 0.0};

  explicit WithNormal(GjkResult& to_) : to(to_) {}

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal_, const btVector3& on_b, btScalar distance) override {
    normal = normal_;
    to.addContactPoint(normal_, on_b, distance);
  }
};

}  // namespace

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
  WithNormal point(result);
  closest_points(a_, b_, input, point);
  return point.normal;
}

}  // namespace energymargin

#include "physics/contacts/solid_pair.hpp"

#include "physics/contacts/gjk.hpp"

namespace energymargin {
namespace {

// Remembers the point. Bullet may turn a normal round after it has separated the solids along the axis that it returns.
struct OnePoint : GjkResult {
  std::optional<ClosestContact> point;

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    point = {normal, on_b, distance};
  }
};

}  // namespace

std::optional<ClosestContact> SolidPair::closest(const btTransform& pose_a, const btTransform& pose_b, double reach) {
  const double margins = margin_a() + margin_b();
  CoreDistance cores;
  const Cores found = cores_.distance(pose_a, pose_b, margins + reach, cores);
  if (found == Cores::too_far) return std::nullopt;
  if (found == Cores::apart) {
    return ClosestContact{cores.normal, cores.on_b + cores.normal * margin_b(), cores.distance - margins};
  }
  GjkInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  input.m_maximumDistanceSquared = (margins + reach) * (margins + reach);
  OnePoint result;
  closest_points(a_, b_, input, result);
  return result.point;
}

}  // namespace energymargin

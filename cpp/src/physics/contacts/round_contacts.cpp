#include "physics/contacts/round_contacts.hpp"

#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

class RoundContacts : public PairContacts {
 public:
  RoundContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
                const btCollisionObjectWrapper& b)
      : PairContacts(info, a, b), solids_(convex_shape(a), convex_shape(b)) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    result->setPersistentManifold(manifold_);
    const double reach = manifold_->getContactBreakingThreshold() + result->m_closestPointDistanceThreshold;
    solids_.add_closest(a->getWorldTransform(), b->getWorldTransform(), reach, *result);
    result->refreshContactPoints();
  }

 private:
  SolidPair solids_;
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

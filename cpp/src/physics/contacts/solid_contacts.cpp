#include "physics/contacts/solid_contacts.hpp"

#include <algorithm>

#include "physics/contacts/face_contacts.hpp"
#include "physics/contacts/found_contacts.hpp"
#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

// Faces that are not flat may miss the deepest point, by more than this share of the margins.
constexpr double same_depth = 0.1;

class Contacts : public PairContacts {
 public:
  Contacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
           const btCollisionObjectWrapper& b, bool with_faces)
      : PairContacts(info, a, b), solids_(convex_shape(a), convex_shape(b)), with_faces_(with_faces) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    result->setPersistentManifold(manifold_);
    const double threshold = manifold_->getContactBreakingThreshold();
    const double reach = threshold + result->m_closestPointDistanceThreshold;
    const btTransform& pose_a = a->getWorldTransform();
    const btTransform& pose_b = b->getWorldTransform();
    const auto closest = solids_.closest(pose_a, pose_b, reach);
    if (!closest) return;
    if (with_faces_) {
      const auto& points = faces_.find(solids_, pose_a, pose_b, closest->normal, threshold, reach);
      if (points.size() > 1) {
        auto& found = static_cast<FoundContacts&>(*result);
        double least = reach;
        for (const FacePoint& point : points) {
          found.add(closest->normal, point.on_b, point.distance, point.grip);
          least = std::min(least, point.distance);
        }
        if (least <= closest->distance + same_depth * (solids_.margin_a() + solids_.margin_b())) return;
      }
    }
    result->addContactPoint(closest->normal, closest->on_b, closest->distance);
  }

 private:
  SolidPair solids_;
  FaceContacts faces_;
  bool with_faces_;
};

}  // namespace

btCollisionAlgorithm* SolidContacts::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                              const btCollisionObjectWrapper* a,
                                                              const btCollisionObjectWrapper* b) {
  static_assert(sizeof(Contacts) <= contacts_size);
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Contacts));
  return new (memory) Contacts(info, *a, *b, with_faces);
}

void SolidContacts::use_in(btCollisionDispatcher& dispatcher) {
  const int solids[] = {CONVEX_HULL_SHAPE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE,
                        CAPSULE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE};
  for (const int a : solids) {
    for (const int b : solids) {
      dispatcher.registerCollisionCreateFunc(a, b, this);
      dispatcher.registerClosestPointsCreateFunc(a, b, this);  // as a pair query asks
    }
  }
}

}  // namespace energymargin

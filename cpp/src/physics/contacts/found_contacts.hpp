#pragma once
// What the algorithms of a pair find in a step.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! As Bullet's btManifoldResult, with a coefficient of friction of the pair. A point that was there before it moves,
//! with its impulses and its friction, instead of making it anew.
class FoundContacts : public btManifoldResult {
 public:
  FoundContacts(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, double friction)
      : btManifoldResult(a, b), friction_(friction) {}

  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override;

 private:
  btManifoldPoint* known(const btVector3& in_a) const;
  void set_friction();

  double friction_;
};

}  // namespace energymargin

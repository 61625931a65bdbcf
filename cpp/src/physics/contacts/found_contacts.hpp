#pragma once
// What the algorithms of a pair find in a step.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! As Bullet's btManifoldResult. A point that was there before it moves, with its impulses and its friction, instead of
//! making it anew.
class FoundContacts : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;

  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override;

 private:
  btManifoldPoint* known(const btVector3& in_a) const;
};

}  // namespace energymargin

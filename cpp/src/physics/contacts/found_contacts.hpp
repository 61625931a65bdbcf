#pragma once
// What the algorithms of a pair find in a step.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/contacts/contact_point.hpp"

namespace energymargin {

//! Collects the points of a pair of bodies. Bullet would keep at most four of them, with what it remembers of the last
//! step; here all count, as they stand.
class FoundContacts : public btManifoldResult {
 public:
  //! Adds to `points`, which outlives this. `friction` is the pair's coefficient.
  FoundContacts(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, double friction,
                std::vector<ContactPoint>& points)
      : btManifoldResult(a, b), friction_(friction), points_(points) {}

  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    add(normal, on_b, distance, on_b);
  }

  //! A point whose friction acts at `grip`.
  void add(const btVector3& normal, const btVector3& on_b, double distance, const btVector3& grip);

 private:
  double friction_;
  std::vector<ContactPoint>& points_;
};

}  // namespace energymargin

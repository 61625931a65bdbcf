#pragma once
// The closest points of one pair of bodies, where they stand.

#include <btBulletDynamicsCommon.h>

#include <limits>

#include "energymargin/types.hpp"
#include "physics/contacts/dispatcher.hpp"

namespace energymargin {

struct ClosestPoints {
  double distance = std::numeric_limits<double>::infinity();  // negative in penetration [m]
  Vector3 position = Vector3::Zero();                         // on the second body [m]
  Vector3 normal = Vector3::UnitZ();                          // to the first body
};

class PairQuery {
 public:
  explicit PairQuery(ContactDispatcher& dispatcher)
      : dispatcher_(dispatcher), world_(&dispatcher.bullet(), nullptr, &dispatcher.configuration()) {}

  //! Up to `reach` [m]; at a greater distance nothing is found.
  ClosestPoints operator()(btCollisionObject& first, btCollisionObject& second, double reach);

 private:
  ContactDispatcher& dispatcher_;
  btCollisionWorld world_;  // without bodies: its test of a pair needs none
};

}  // namespace energymargin

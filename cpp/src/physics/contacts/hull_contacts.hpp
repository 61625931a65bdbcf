#pragma once
// Contacts of convex hulls, whose faces may lie on other faces.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! Makes the contacts of a hull with another solid: the closest points and, where faces or lines may lie on one
//! another, those of bodies that are tilted a little, to all sides. Bullet does the same, but tilts by an angle of 2 cm
//! over the body's reach: by 20 degrees for one of 6 cm, which makes points that are ten times as deep as the bodies
//! overlap.
struct HullContacts : btCollisionAlgorithmCreateFunc {
  bool tilted = true;  //!< whether there are points of tilted bodies, in what is made from now on

  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override;

  //! For every pair of solids that `dispatcher` would leave to Bullet's general algorithm.
  void use_in(btCollisionDispatcher& dispatcher);
};

}  // namespace energymargin

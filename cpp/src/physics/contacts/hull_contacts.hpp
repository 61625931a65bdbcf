#pragma once
// Contacts of convex hulls, whose faces may lie on other faces.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! Makes the contacts of a hull with another solid: the closest points and, where faces or lines lie on one another,
//! the corners of what they share. Bullet finds those by tilting a body to all sides, by an angle of 2 cm over its
//! reach, which is 20 degrees for one of 6 cm, and makes points that are ten times as deep as the bodies overlap.
struct HullContacts : btCollisionAlgorithmCreateFunc {
  bool with_faces = true;  //!< whether there are points of faces, in what is made from now on

  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override;

  //! For every pair of solids that `dispatcher` would leave to Bullet's general algorithm.
  void use_in(btCollisionDispatcher& dispatcher);
};

}  // namespace energymargin

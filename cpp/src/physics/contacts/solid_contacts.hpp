#pragma once
// Contacts of two convex solids.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

//! Makes the contacts of two solids: the corners of what their faces or lines share, where these lie on one another, or
//! else the closest points. They are found anew in each step, from where the solids stand alone. Bullet finds faces by
//! tilting a body to all sides, by an angle of 2 cm over its reach, which is 20 degrees for one of 6 cm, and keeps four
//! points with what it remembers of them.
struct SolidContacts : btCollisionAlgorithmCreateFunc {
  bool with_faces = true;  //!< whether there are points of faces, in what is made from now on

  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override;

  //! For all pairs of solids.
  void use_in(btCollisionDispatcher& dispatcher);
};

}  // namespace energymargin

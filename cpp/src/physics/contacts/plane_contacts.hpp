#pragma once
// Contacts of solids with a plane, all points at once.

class btCollisionDispatcher;

namespace energymargin {

//! Makes `dispatcher` use these contacts for every solid on a plane. Bullet's own algorithm finds one point a step and
//! gathers the rest over several; a body that slides fast loses them again, sinks and tilts.
void use_plane_contacts(btCollisionDispatcher& dispatcher);

}  // namespace energymargin

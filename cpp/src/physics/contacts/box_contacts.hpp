#pragma once
// Contacts of two boxes, also where they only just touch.

class btCollisionDispatcher;

namespace energymargin {

//! Makes `dispatcher` use these contacts for two boxes. Bullet's own algorithm finds points that are in the other box
//! alone: of a box that rests on another one it depends on the last digit whether there are four, two or none.
void use_box_contacts(btCollisionDispatcher& dispatcher);

}  // namespace energymargin

#pragma once
// Which algorithm finds the contacts of which two shapes.

#include <btBulletDynamicsCommon.h>

#include "physics/contacts/solid_contacts.hpp"

namespace energymargin {

//! Bullet's dispatcher with the contacts of this library: solids on planes and on each other.
class ContactDispatcher {
 public:
  ContactDispatcher();
  ContactDispatcher(const ContactDispatcher&) = delete;
  ContactDispatcher& operator=(const ContactDispatcher&) = delete;

  btCollisionDispatcher& bullet() { return dispatcher_; }
  const btCollisionDispatcher& bullet() const { return dispatcher_; }
  btDefaultCollisionConfiguration& configuration() { return configuration_; }

  //! While this lives, new pairs get the closest points alone.
  class SinglePoints {
   public:
    explicit SinglePoints(ContactDispatcher& dispatcher) : solids_(dispatcher.solid_contacts_) {
      solids_.with_faces = false;
    }
    ~SinglePoints() { solids_.with_faces = true; }
    SinglePoints(const SinglePoints&) = delete;
    SinglePoints& operator=(const SinglePoints&) = delete;

   private:
    SolidContacts& solids_;
  };

 private:
  btDefaultCollisionConfiguration configuration_;
  SolidContacts solid_contacts_;
  btCollisionDispatcher dispatcher_;
};

}  // namespace energymargin

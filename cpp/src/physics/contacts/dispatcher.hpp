#pragma once
// Which algorithm finds the contacts of which two shapes.

#include <btBulletDynamicsCommon.h>

#include "physics/contacts/hull_contacts.hpp"

namespace energymargin {

//! Bullet's dispatcher with the contacts of this library: solids on planes, boxes, hulls and round solids.
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
    explicit SinglePoints(ContactDispatcher& dispatcher) : hulls_(dispatcher.hull_contacts_) {
      hulls_.with_faces = false;
    }
    ~SinglePoints() { hulls_.with_faces = true; }
    SinglePoints(const SinglePoints&) = delete;
    SinglePoints& operator=(const SinglePoints&) = delete;

   private:
    HullContacts& hulls_;
  };

 private:
  btDefaultCollisionConfiguration configuration_;
  HullContacts hull_contacts_;
  btCollisionDispatcher dispatcher_;
};

}  // namespace energymargin

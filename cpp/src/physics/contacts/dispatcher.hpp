#pragma once
// Which algorithm finds the contacts of which two shapes.

#include <btBulletDynamicsCommon.h>

#include "physics/contacts/hull_contacts.hpp"

namespace energymargin {

//! Whose algorithm finds the contacts of cylinders, capsules and spheres with boxes and cylinders.
enum class RoundAlgorithm {
  exact,   ///< this library's, see round_contacts.hpp
  bullet,  ///< Bullet's, for comparison
};

//! Bullet's dispatcher with the contacts of this library: solids on planes, boxes, hulls and round solids.
class ContactDispatcher {
 public:
  explicit ContactDispatcher(RoundAlgorithm round = RoundAlgorithm::exact);
  ContactDispatcher(const ContactDispatcher&) = delete;
  ContactDispatcher& operator=(const ContactDispatcher&) = delete;

  btCollisionDispatcher& bullet() { return dispatcher_; }
  const btCollisionDispatcher& bullet() const { return dispatcher_; }
  btDefaultCollisionConfiguration& configuration() { return configuration_; }

  //! While this lives, new pairs get no points of tilted hulls: those are not exact, and Bullet has others for two
  //! single solids.
  class SinglePoints {
   public:
    explicit SinglePoints(ContactDispatcher& dispatcher) : hulls_(dispatcher.hull_contacts_) { hulls_.tilted = false; }
    ~SinglePoints() { hulls_.tilted = true; }
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

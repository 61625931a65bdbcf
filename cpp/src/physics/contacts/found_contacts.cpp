#include "physics/contacts/found_contacts.hpp"

#include "physics/shapes.hpp"

namespace energymargin {

// An algorithm may have swapped the bodies of its pair: those of its manifold are the ones that it means.
void FoundContacts::add(const btVector3& normal, const btVector3& on_b, double distance, const btVector3& grip) {
  if (distance > m_manifoldPtr->getContactBreakingThreshold()) return;
  points_.push_back({body_index(*m_manifoldPtr->getBody0()), body_index(*m_manifoldPtr->getBody1()),
                     on_b + normal * distance, on_b, grip, normal, distance, friction_});
}

}  // namespace energymargin

#include "physics/contacts/found_contacts.hpp"

namespace energymargin {

void FoundContacts::addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) {
  if (distance > m_manifoldPtr->getContactBreakingThreshold()) return;
  const btVector3 on_a = on_b + normal * distance;
  const btVector3 in_a = m_manifoldPtr->getBody0()->getWorldTransform().invXform(on_a);
  btManifoldPoint* const point = known(in_a);
  if (!point) {
    btManifoldResult::addContactPoint(normal, on_b, distance);
    return set_friction();
  }
  point->m_localPointA = in_a;
  point->m_localPointB = m_manifoldPtr->getBody1()->getWorldTransform().invXform(on_b);
  point->m_positionWorldOnA = on_a;
  point->m_positionWorldOnB = on_b;
  point->m_normalWorldOnB = normal;
  point->m_distance1 = distance;
}

// Bullet gives a new point, which may be any of them, the product of the two bodies' coefficients.
void FoundContacts::set_friction() {
  for (int i = 0; i < m_manifoldPtr->getNumContacts(); ++i) {
    m_manifoldPtr->getContactPoint(i).m_combinedFriction = friction_;
  }
}

// The nearest, as Bullet looks for it.
btManifoldPoint* FoundContacts::known(const btVector3& in_a) const {
  const double threshold = m_manifoldPtr->getContactBreakingThreshold();
  double nearest = threshold * threshold;
  btManifoldPoint* point = nullptr;
  for (int i = 0; i < m_manifoldPtr->getNumContacts(); ++i) {
    btManifoldPoint& other = m_manifoldPtr->getContactPoint(i);
    const double squared = (other.m_localPointA - in_a).length2();
    if (squared >= nearest) continue;
    nearest = squared;
    point = &other;
  }
  return point;
}

}  // namespace energymargin

#include "physics/contacts/contact_points.hpp"

#include "physics/shapes.hpp"

namespace energymargin {
namespace {

double trace(const btMatrix3x3& m) { return m[0][0] + m[1][1] + m[2][2]; }

}  // namespace

std::vector<Contact> contact_points(const btCollisionDispatcher& dispatcher, const Scene& scene, double duration) {
  std::vector<Contact> contacts;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    const std::size_t a = body_index(*manifold->getBody0());
    const std::size_t b = body_index(*manifold->getBody1());
    for (int j = 0; j < manifold->getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold->getContactPoint(j);
      const btVector3 tangential = (point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                                    point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2) /
                                   duration;
      contacts.push_back({scene.bodies()[a].name, scene.bodies()[b].name, from_bullet(point.getPositionWorldOnB()),
                          from_bullet(point.m_normalWorldOnB), point.getDistance(),
                          point.getAppliedImpulse() / duration, from_bullet(tangential), scene.contact_friction(a, b)});
    }
  }
  return contacts;
}

void turn_normals(btDispatcher& dispatcher, const std::vector<btMatrix3x3>& before) {
  const auto turn = [&](const btCollisionObject& body) {
    return body.getWorldTransform().getBasis() * before[body_index(body)].transpose();
  };
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    const btCollisionObject& a = *manifold.getBody0();
    const btCollisionObject& b = *manifold.getBody1();
    if (manifold.getNumContacts() == 0 || a.isStaticObject() || b.isStaticObject()) continue;
    const btMatrix3x3 of_a = turn(a);
    const btMatrix3x3 of_b = turn(b);
    const btMatrix3x3& common = trace(of_a) > trace(of_b) ? of_a : of_b;
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      btVector3& normal = manifold.getContactPoint(j).m_normalWorldOnB;
      normal = (common * normal).normalized();
    }
  }
}

}  // namespace energymargin

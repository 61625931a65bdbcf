#include "physics/contacts/contact_points.hpp"

#include "physics/shapes.hpp"

namespace energymargin {

std::vector<Contact> contact_points(const std::vector<ContactPoint>& points, const Scene& scene, double duration) {
  std::vector<Contact> contacts;
  for (const ContactPoint& point : points) {
    contacts.push_back({scene.bodies()[point.a].name, scene.bodies()[point.b].name, from_bullet(point.on_b),
                        from_bullet(point.normal), point.distance, point.normal_impulse / duration,
                        from_bullet(point.friction_impulse / duration), scene.contact_friction(point.a, point.b)});
  }
  return contacts;
}

}  // namespace energymargin

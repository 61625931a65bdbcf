#include "physics/placement.hpp"

namespace energymargin {

Contact Placement::deepest_contact() {
  Contact deepest;
  for (const auto& [a, b] : pairs.near()) {
    const auto closest = pairs.closest(a, b, 0.0);
    if (!closest || closest->distance >= deepest.distance) continue;
    deepest.body_a = scene_.bodies()[a].name;
    deepest.body_b = scene_.bodies()[b].name;
    deepest.distance = closest->distance;
    deepest.position = from_bullet(closest->on_b);
    deepest.normal = from_bullet(closest->normal);
    deepest.friction = scene_.contact_friction(a, b);
  }
  return deepest;
}

Contact deepest_contact(const Scene& scene, const State& state) {
  Placement placement(scene);
  placement.restore(state);
  return placement.deepest_contact();
}

}  // namespace energymargin

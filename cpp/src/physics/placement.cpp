#include "physics/placement.hpp"

#include "physics/deepest_contact.hpp"

namespace energymargin {

Contact Placement::deepest_contact() {
  const std::vector<Body>& bodies = scene_.bodies();
  Contact deepest;
  for (const auto& [a, b] : pairs_.near()) {
    const ClosestPoints points = closest_points(a, b, 0.0);
    if (points.distance >= deepest.distance) continue;
    deepest.body_a = bodies[a].name;
    deepest.body_b = bodies[b].name;
    deepest.distance = points.distance;
    deepest.position = points.position;
    deepest.normal = points.normal;
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

#include "physics/springs.hpp"

#include <tuple>

#include "physics/shapes.hpp"

namespace energymargin {

Springs::Springs(const Scene& scene, const MovingBodies& moving)
    : bodies_(scene.bodies()), springs_(scene.springs()), moving_(moving) {
  const auto in_bullet = [&](std::size_t body, const Vector3& point) {
    const Inertial& inertial = scene.inertial(body);
    return to_bullet(Vector3(inertial.axes.conjugate() * (point - inertial.center)));
  };
  for (const Spring& spring : springs_) {
    const std::size_t a = scene.index(spring.body_a);
    const std::size_t b = scene.index(spring.body_b);
    ends_.push_back({a, b, in_bullet(a, spring.point_a), in_bullet(b, spring.point_b)});
  }
}

SpringSpan Springs::span(std::size_t spring) const {
  const Ends& ends = ends_[spring];
  SpringSpan span{in_world(ends.body_a, ends.point_a), in_world(ends.body_b, ends.point_b), btVector3(0, 0, 0), 0.0};
  span.length = (span.end_b - span.end_a).length();
  if (span.length == 0.0) return span;
  span.along = (span.end_b - span.end_a) / span.length;
  span.length_rate =
      span.along.dot(moving_.velocity(ends.body_b, span.end_b) - moving_.velocity(ends.body_a, span.end_a));
  return span;
}

void Springs::update() {
  loads_.clear();
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    const SpringSpan now = span(i);
    if (now.length == 0.0) continue;  // it pulls nowhere
    const double stretch = now.length - springs_[i].rest_length;
    add_loads(i, now, springs_[i].stiffness * stretch + springs_[i].damping * now.length_rate, loads_);
  }
}

void Springs::add_stiffness(Motion& motion) const {
  std::vector<Load> loads;
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    const SpringSpan now = span(i);
    add_loads(i, now, springs_[i].stiffness * (now.length - springs_[i].rest_length), loads);
  }
  for (const Load& load : loads) {
    motion.bodies[load.body].force += load.force;
    motion.bodies[load.body].torque += load.torque;
  }
}

// At the ends that can move.
void Springs::add_loads(std::size_t spring, const SpringSpan& span, double tension, std::vector<Load>& loads) const {
  const btVector3 pull = span.along * tension;
  const Ends& ends = ends_[spring];
  for (const auto& [body, end, force] :
       {std::tuple{ends.body_a, span.end_a, pull}, std::tuple{ends.body_b, span.end_b, btVector3(-pull)}}) {
    if (bodies_[body].fixed()) continue;
    const btVector3& center = moving_.poses()[body].getOrigin();
    loads.push_back({body, force, (end - center).cross(force)});
  }
}

btVector3 Springs::in_world(std::size_t body, const btVector3& point) const { return moving_.poses()[body] * point; }

}  // namespace energymargin

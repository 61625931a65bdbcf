#pragma once
// The springs of a scene, as loads on its bodies.

#include <tuple>
#include <vector>

#include "energymargin/scene.hpp"
#include "physics/bodies/moving_bodies.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! A spring at this moment.
struct SpringSpan {
  btVector3 end_a, end_b;    // in the world [m]
  btVector3 along;           // unit vector from a to b; 0 where they meet
  double length;             // [m]
  double length_rate = 0.0;  // [m/s]
};

class Springs {
 public:
  //! `moving` are the bodies of `scene`; both outlive this.
  Springs(const Scene& scene, const MovingBodies& moving) : scene_(scene), moving_(moving) {
    const auto in_bullet = [&](std::size_t body, const Vector3& point) {
      const Inertial& inertial = scene.inertial(body);
      return to_bullet(Vector3(inertial.axes.conjugate() * (point - inertial.center)));
    };
    for (const Spring& spring : scene.springs()) {
      const std::size_t a = scene.index(spring.body_a);
      const std::size_t b = scene.index(spring.body_b);
      ends_.push_back({a, b, in_bullet(a, spring.point_a), in_bullet(b, spring.point_b)});
    }
  }

  //! By the index in the scene.
  SpringSpan span(std::size_t spring) const {
    const Ends& ends = ends_[spring];
    const std::vector<btTransform>& poses = moving_.poses();
    SpringSpan span{poses[ends.body_a] * ends.point_a, poses[ends.body_b] * ends.point_b, btVector3(0, 0, 0), 0.0};
    span.length = (span.end_b - span.end_a).length();
    if (span.length == 0.0) return span;
    span.along = (span.end_b - span.end_a) / span.length;
    span.length_rate =
        span.along.dot(moving_.velocity(ends.body_b, span.end_b) - moving_.velocity(ends.body_a, span.end_a));
    return span;
  }

  //! Loads on the ends that can move, of stiffness and maybe of damping.
  std::vector<Load> loads(bool damped) const {
    std::vector<Load> loads;
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      const SpringSpan now = span(i);
      if (now.length == 0.0) continue;  // it pulls nowhere
      const Spring& spring = scene_.springs()[i];
      double tension = spring.stiffness * (now.length - spring.rest_length);
      if (damped) tension += spring.damping * now.length_rate;
      const btVector3 pull = now.along * tension;
      for (const auto& [body, end, force] :
           {std::tuple{ends_[i].body_a, now.end_a, pull}, std::tuple{ends_[i].body_b, now.end_b, btVector3(-pull)}}) {
        if (scene_.bodies()[body].fixed()) continue;
        loads.push_back({body, force, (end - moving_.poses()[body].getOrigin()).cross(force)});
      }
    }
    return loads;
  }

 private:
  struct Ends {
    std::size_t body_a, body_b;
    btVector3 point_a, point_b;  // in Bullet's frames of the bodies
  };

  const Scene& scene_;
  const MovingBodies& moving_;
  std::vector<Ends> ends_;
};

}  // namespace energymargin

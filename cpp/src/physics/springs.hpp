#pragma once
// The springs of a scene, as loads on its bodies.

#include <vector>

#include "energymargin/scene.hpp"
#include "physics/bodies/moving_bodies.hpp"

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
  Springs(const Scene& scene, const MovingBodies& moving);

  //! By the index in the scene.
  SpringSpan span(std::size_t spring) const;

  //! Loads on the ends that can move, of stiffness and maybe of damping.
  std::vector<Load> loads(bool damped) const;

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

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

  //! Finds the loads of stiffness and damping. A damper answers to the speed at the start of a substep, before
  //! any force of that one: so this is asked when the substep before is over.
  void update();
  const std::vector<Load>& loads() const { return loads_; }

  //! Adds the loads of stiffness alone.
  void add_stiffness(Motion& motion) const;

 private:
  struct Ends {
    std::size_t body_a, body_b;
    btVector3 point_a, point_b;  // in Bullet's frames of the bodies
  };

  void add_loads(std::size_t spring, const SpringSpan& span, double tension, std::vector<Load>& loads) const;
  btVector3 in_world(std::size_t body, const btVector3& point) const;

  const std::vector<Body>& bodies_;
  const std::vector<Spring>& springs_;
  const MovingBodies& moving_;
  std::vector<Ends> ends_;
  std::vector<Load> loads_;
};

}  // namespace energymargin

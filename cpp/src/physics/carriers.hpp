#pragma once
// Which bodies go along with a kinematic one in time that is lost.

#include <vector>

#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/contact_point.hpp"

namespace energymargin {

//! A kinematic body loses no time. What it touches, or what touches that, goes along with it: it pushes, and passes
//! only what something else holds. So each body has at most one carrier.
class Carriers {
 public:
  //! Both outlive this.
  Carriers(const Scene& scene, MovingBodies& bodies) : scene_(scene), bodies_(bodies) {}

  //! Moves what is carried for so long [s]; `ways` are the velocities of all bodies.
  void carry(const std::vector<ContactPoint>& points, const std::vector<Velocity>& ways, double lost);

 private:
  void spread(const ContactPoint& point);
  void hold(const ContactPoint& point, const std::vector<Velocity>& ways);
  void join(std::size_t from, std::size_t to);
  void stop(std::size_t body);
  bool kinematic(std::size_t body) const { return scene_.bodies()[body].kinematic; }
  btVector3 origin(std::size_t body) const { return bodies_.colliders()[body]->getWorldTransform().getOrigin(); }
  btVector3 velocity(std::size_t body, const btVector3& point, const std::vector<Velocity>& ways) const;

  const Scene& scene_;
  MovingBodies& bodies_;
  std::vector<int> carriers_;  // of each body, or of the base of its tree; -1: none
  bool changed_ = false;
};

}  // namespace energymargin

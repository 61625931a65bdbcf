#pragma once
// Which pairs of bodies can collide, and how rough their contacts are.

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "energymargin/scene.hpp"

namespace energymargin {

//! All pairs can, except two fixed bodies, two bodies that a joint connects, which overlap there, and those that the
//! scene disables. The scene outlives this.
class CollisionFilter {
 public:
  explicit CollisionFilter(const Scene& scene) : scene_(scene), bodies_(scene.bodies()) {
    for (const Joint& joint : scene.joints()) exclude(scene.index(joint.parent), scene.index(joint.child));
    for (const auto& [a, b] : scene.disabled_collisions()) exclude(scene.index(a), scene.index(b));
  }

  //! `a` and `b` are indices in the scene.
  bool operator()(std::size_t a, std::size_t b) const {
    return !(bodies_[a].fixed() && bodies_[b].fixed()) && excluded_.count(std::minmax(a, b)) == 0;
  }

  //! Coefficient of friction of their contacts.
  double friction(std::size_t a, std::size_t b) const { return std::min(scene_.contact_friction(a, b), most_friction); }

 private:
  static constexpr double most_friction = 10.0;  // Bullet's own bound: a slope of 84 deg

  void exclude(std::size_t a, std::size_t b) { excluded_.insert(std::minmax(a, b)); }

  const Scene& scene_;
  const std::vector<Body>& bodies_;
  std::set<std::pair<std::size_t, std::size_t>> excluded_;  // the lower index first
};

}  // namespace energymargin

#pragma once
// Which pairs of bodies can collide, and how rough their contacts are.

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "energymargin/scene.hpp"

namespace energymargin {

//! All pairs can, except two bodies that no contact can move, or that are rigid on one, two bodies that a joint
//! connects, which are in each other there, and those that the scene disables. The scene outlives this.
class CollisionFilter {
 public:
  explicit CollisionFilter(const Scene& scene) : scene_(scene), bodies_(scene.bodies()) {
    for (const Joint& joint : scene.joints()) exclude(scene.index(joint.parent), scene.index(joint.child));
    for (const auto& [a, b] : scene.disabled_collisions()) exclude(scene.index(a), scene.index(b));
    for (std::size_t body = 0; body < bodies_.size(); ++body) carriers_.push_back(carrier(body));
  }

  //! `a` and `b` are indices in the scene.
  bool operator()(std::size_t a, std::size_t b) const {
    if (carriers_[a] == carriers_[b] || excluded_.count(std::minmax(a, b)) != 0) return false;
    const Body& of_a = bodies_[carriers_[a]];
    const Body& of_b = bodies_[carriers_[b]];
    if (of_a.dynamic() || of_b.dynamic()) return true;
    return !of_a.kinematic && !of_b.kinematic && !(bodies_[a].fixed() && bodies_[b].fixed());
  }

  //! The distance at which one looks for contacts of a body that bounces, to know when it touches, and of one that
  //! gives way, whose overlap would throw it; else 0 [m].
  double early_reach(std::size_t body) const {
    constexpr double fastest = 10.0;  // m/s, of bodies that are not in each other before they touch
    const Surface surface = bodies_[body].surface.value_or(Surface{});
    return surface.restitution > 0.0 || surface.stiffness > 0.0 ? fastest * scene_.stepping().step : 0.0;
  }

  bool compliant(std::size_t a, std::size_t b) const { return scene_.contact_surface(a, b).stiffness > 0.0; }

 private:
  // What a body is rigid on, in the end: itself, unless a joint holds it that does not move.
  std::size_t carrier(std::size_t body) const {
    const auto joint = scene_.joint_to(body);
    if (!joint || !scene_.rigid(scene_.joints()[*joint])) return body;
    return carrier(scene_.index(scene_.joints()[*joint].parent));
  }

  void exclude(std::size_t a, std::size_t b) { excluded_.insert(std::minmax(a, b)); }

  const Scene& scene_;
  const std::vector<Body>& bodies_;
  std::set<std::pair<std::size_t, std::size_t>> excluded_;  // the lower index first
  std::vector<std::size_t> carriers_;
};

}  // namespace energymargin

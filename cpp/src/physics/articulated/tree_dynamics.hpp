#pragma once
// The equations of motion of a tree of links.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/articulated/articulation.hpp"
#include "physics/articulated/spatial.hpp"

namespace energymargin {

//! inertia * rate of the velocities + bias = forces along the velocities, by Newton and Euler's recursion for the bias
//! and by composite bodies for the inertia (Featherstone 2008, tables 5.1 and 6.2). Drives are implicit: what they
//! resist counts as inertia. The inverse is found once a part, and a response to an impulse is a product with it.
class TreeDynamics {
 public:
  //! The tree outlives this.
  explicit TreeDynamics(Articulation& tree);

  Articulation& tree() const { return tree_; }

  //! Of velocities, made even.
  std::size_t size() const { return size_; }

  //! Of the tree where it is, with its loads.
  void update(const btVector3& gravity);

  //! Velocities after `duration` [s] without contacts and stops. Drives act but for those that are at their limits.
  void start(double duration, double* velocities);

  //! Change of the velocities by impulses along them.
  void respond(const double* impulses, double* changes) const;

  //! Adds what an impulse on a link is along the velocities.
  void add(int link, const btVector3& point, const btVector3& impulse, double* impulses) const;

 private:
  void add_bodies(const btVector3& gravity);
  void invert();

  Articulation& tree_;
  std::size_t count_, size_;
  std::vector<int> links_;  // of the velocities
  std::vector<double> inertia_, inverse_, forces_, rates_;
  std::vector<SpatialInertia> bodies_;                      // each link with all that hangs on it
  std::vector<SpatialVector> accelerations_, link_forces_;  // of the links, with constant velocities
};

}  // namespace energymargin

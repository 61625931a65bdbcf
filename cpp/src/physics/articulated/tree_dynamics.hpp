#pragma once
// The equations of motion of a tree of links.

#include <btBulletDynamicsCommon.h>

#include <array>
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

  //! Of the tree where it is, with its loads. A kinematic base keeps its velocities, until `drive_base`.
  void update(const btVector3& gravity);

  //! Velocities of a kinematic base in this part, whatever acts on the tree.
  void drive_base(const btVector3& linear, const btVector3& angular);

  //! Velocities after `duration` [s] without contacts and stops. Drives act but for those that are at their limits.
  void start(double duration, double* velocities);

  //! Work of what drives a kinematic base, but for impulses on the tree, from velocities before to after [J].
  double work_on_base(double duration, const double* before, const double* after) const;

  //! Change of the velocities by impulses along them.
  void respond(const double* impulses, double* changes) const;

  //! Adds what an impulse on a link is along the velocities.
  void add(int link, const btVector3& point, const btVector3& impulse, double* impulses) const;

 private:
  void add_bodies(const btVector3& gravity);
  void add_base_changes();
  void invert();
  std::size_t prescribed() const { return tree_.kinematic() ? velocities_of_free_body : 0; }

  Articulation& tree_;
  std::size_t count_, size_;
  std::vector<int> links_;  // of the velocities
  std::vector<double> inertia_, inverse_, forces_, rates_;
  std::array<double, velocities_of_free_body> base_{};      // velocities of a kinematic base in this part
  std::vector<SpatialInertia> bodies_;                      // each link with all that hangs on it
  std::vector<SpatialVector> accelerations_, link_forces_;  // of the links, with constant velocities
};

}  // namespace energymargin

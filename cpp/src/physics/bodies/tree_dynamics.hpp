#pragma once
// The equations of motion of a tree of links.

#include <btBulletDynamicsCommon.h>

#include <array>
#include <vector>

#include "physics/bodies/articulation.hpp"
#include "physics/bodies/spatial.hpp"

namespace energymargin {

//! inertia * rate of the velocities + bias = forces along the velocities, by composite bodies for the inertia and by
//! Newton and Euler's recursion for the bias (Featherstone 2008, tables 6.2 and 5.1). Drives without a torque limit are
//! implicit: what they resist counts as inertia.
//!
//! A substep kicks the velocities where the tree stands, by forces and by the impulses of constraints, and then
//! lets it coast. Coasting keeps energy and momentum: it is a Runge-Kutta step of the fourth order where they count,
//! which is without drives, or on a free base.
class TreeDynamics {
 public:
  //! The tree outlives this.
  explicit TreeDynamics(Articulation& tree);

  Articulation& tree() const { return tree_; }

  //! Velocities that are not prescribed by a kinematic base, and where they begin among the tree's.
  std::size_t prescribed() const { return tree_.kinematic() ? velocities_of_free_body : 0; }

  //! Velocities of a kinematic base in this substep, whatever acts on the tree; otherwise it keeps what it has.
  void keep_base();
  void drive_base(const btVector3& linear, const btVector3& angular);

  //! Where the tree is, with its loads: what they do in `duration` [s]. A tree that is `alone`, which nothing
  //! constrains and nothing drives, feels gravity as it coasts.
  void prepare(double duration, const btVector3& gravity, bool alone);
  bool drives() const { return drives_; }

  //! A tree whose joints follow others does not coast, which would part them: what its velocities do to it is a force.
  void couple() { coupled_ = true; }

  //! Inertia with what the drives resist, row by row, count() each.
  std::size_t count() const { return count_; }
  const double* inertia_row(std::size_t i) const { return driven_.data() + i * count_; }

  //! Velocities after the forces.
  const std::vector<double>& kicked() const { return kicked_; }

  //! Acceleration of a link's point as the tree coasts [m/s^2].
  btVector3 bend(int link, const btVector3& point) const;

  //! How fast a link turns [rad/s].
  double spin(int link) const { return motions_[static_cast<std::size_t>(link)].angular.length(); }

  //! Lets the tree coast from these velocities: they become those at the end, and `way` those of the way to there.
  void coast(double duration, std::vector<double>& velocities, std::vector<double>& way);

  //! Work of what drives a kinematic base, but for impulses on the tree, from velocities before to after [J].
  double work_on_base(double duration, const double* before, const double* after) const;

  //! Of a tree that feels gravity as it coasts: half a substep's length times by how much its power grows, from
  //! velocities before to after, which is where its way ends [J]. Zero for other trees.
  double gravity_beside(double duration, const std::vector<double>& before, const std::vector<double>& after);

  //! Adds what an impulse on a link is along the velocities.
  void add(int link, const btVector3& point, const btVector3& impulse, double* impulses) const;

 private:
  using Matrix = std::vector<double>;

  void find_inertia();
  void find_forces(const btVector3& gravity, bool loads);
  void find_bias(const std::vector<double>& velocities);
  void find_accelerations();
  void kick(double duration);
  void coast_by_runge_kutta(double duration, std::vector<double>& velocities, std::vector<double>& way);
  void rate(const std::vector<double>& way, const std::vector<double>& velocities, std::vector<double>& way_rate,
            std::vector<double>& acceleration);
  void accelerate(const Matrix& factors, std::vector<double>& rates) const;
  void factor(Matrix& matrix) const;

  Articulation& tree_;
  std::size_t count_;
  std::vector<int> links_;  // of the velocities
  Matrix inertia_, driven_, factors_;
  std::vector<double> forces_, bias_, rates_, coasting_, kicked_;
  std::array<double, velocities_of_free_body> base_{};      // velocities of a kinematic base in this substep
  std::vector<SpatialInertia> bodies_, composites_;         // each link alone, and with all that hangs on it
  std::vector<SpatialVector> accelerations_, link_forces_;  // of the links, with constant velocities
  std::vector<SpatialVector> motions_;                      // of the links
  btVector3 coasting_gravity_ = btVector3(0, 0, 0);
  bool drives_ = false, coupled_ = false;
};

}  // namespace energymargin

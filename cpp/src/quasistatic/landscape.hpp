#pragma once
// The energy landscape of an object that is moved slowly while everything else stays: where it may be, on which ways,
// and how high its energy is there (Definitions 1 and 2).

#include <optional>
#include <vector>

#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "physics/free_space.hpp"
#include "quasistatic/path.hpp"
#include "quasistatic/potential.hpp"

namespace energymargin::quasistatic {

//! How an object can turn.
enum class Turning {
  none,        ///< not at all, or it makes no difference: a ball
  about_axis,  ///< about one axis of the world
  all,         ///< freely
};

//! Where a pose lies.
enum class Side {
  captured,  ///< in the capture set: an escape ends where it leaves that
  outside,   ///< outside of it, settled as low as it gets there
  any,
};

//! One object of a problem, quasi-statically. Its poses are those of its centre of mass: so it turns about that, and
//! without springs its energy is linear on a way. One thread at a time.
class Landscape {
 public:
  //! `object` is the index of a body that moves freely.
  Landscape(const Problem& problem, std::size_t object);

  const Pose& start() const { return start_; }
  const Vector3& sliding() const { return body_.linear_factor; }  //!< 1: free along the axis, 0: locked
  Turning turning() const { return turning_; }
  const Vector3& axis() const { return axis_; }  //!< for Turning::about_axis
  const Potential& potential() const { return potential_; }
  double size() const { return size_; }      //!< the object's smallest half extent [m]
  double radius() const { return radius_; }  //!< of its farthest point from its centre of mass [m]

  //! Potential energy above that at the start, and at least 0 [J].
  double energy(const Pose& pose) const;

  //! The energy of a move as short as the depth that counts as touching [J].
  double negligible() const { return negligible_; }

  //! Whether the object overlaps nothing, and is within Z_b.
  bool allowed(const Pose& pose);

  //! Whether the object is outside of the capture set, at rest.
  bool outside(const Pose& pose);

  //! How far the object moves: no point of it moves farther on the way [m].
  double length(const Pose& from, const Pose& to) const;

  //! Appends the poses of a way but its first, a tenth of the radius apart or closer.
  void append_way(const Pose& from, const Pose& to, Path& way) const;

  struct Peak {
    double energy = 0.0;  //!< [J]
    double at = 0.0;      //!< share of the way, 0..1
  };

  //! The highest energy on a way. With springs, what is high for less than a tenth of the radius may be missed.
  Peak peak(const Pose& from, const Pose& to) const;

  //! Whether a way is allowed up to its end; its start is. No wall is too thin: between two poses that are checked no
  //! point moves farther than a hundredth of the object's smallest half extent, unless the clearance there is larger.
  //! So the object may cut a corner by that little.
  bool passes(const Pose& from, const Pose& to);

  //! Slides down the slope of the energy until something is in the way, at most by `reach` [m] along any axis of the
  //! world from the start; with `outside`, without entering the capture set.
  Pose settle(Pose pose, double reach, bool outside);

  //! The full state with the object at a pose, all at rest. The next call overwrites it.
  const State& state(const Pose& pose);

 private:
  Pose frame(const Pose& pose) const;
  bool in_reach(const Pose& pose, double reach) const;
  Vector3 downhill(const Pose& pose) const;
  bool within(const Pose& pose);

  Body body_;
  Vector3 center_;  // of mass, in the body's frame
  Pose start_;
  FreeSpace free_space_;
  Potential potential_;
  Membership captured_;
  std::optional<Membership> within_;
  Turning turning_ = Turning::none;
  Vector3 axis_ = Vector3::UnitZ();
  double size_, radius_, spacing_, least_step_;
  double start_energy_ = 0.0;
  double negligible_ = 0.0;
  int offset_;
  State state_;
  std::vector<std::pair<double, double>> stretches_;  // of a way, as shares of it, still to be checked
};

}  // namespace energymargin::quasistatic

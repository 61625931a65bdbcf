#pragma once
// The energy landscape of an object that is moved slowly while everything else stays: where it may be, on which ways,
// and how high its energy is there (Definitions 1 and 2).

#include <optional>
#include <utility>
#include <vector>

#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "physics/free_space.hpp"

namespace energymargin::quasistatic {

//! Poses from the start on; from one to the next the object moves evenly, and turns the shorter way.
using Path = std::vector<Pose>;

//! The pose at a share `t` of the way, 0..1.
Pose interpolate(const Pose& from, const Pose& to, double t);

//! Angle between two orientations, 0..pi [rad].
double angle(const Quaternion& a, const Quaternion& b);

//! The potential energy of one body while everything else stays where it is: E of Definition 2.
class Potential {
 public:
  //! `body` is an index in the scene; `state` says where everything else is.
  Potential(const Scene& scene, const State& state, std::size_t body);

  //! Of gravity, the body's constant force and the springs on it, with its zero at the world's origin [J].
  double operator()(const Pose& pose) const;

  //! What pulls at the body [N]: minus the slope of the energy in the position.
  Vector3 force(const Pose& pose) const;

  //! Gravity and the constant force alone [N].
  const Vector3& load() const { return load_; }
  bool has_springs() const { return !springs_.empty(); }

  //! Whether a turn about the frame's origin changes it.
  bool turns() const;

 private:
  struct End {       // of a spring, at the body
    Vector3 point;   // in the body's frame
    Vector3 anchor;  // the other end, in the world
    double stiffness, rest_length;
  };

  Vector3 load_, center_;
  std::vector<End> springs_;
};

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

//! One object of a problem, quasi-statically. Its poses are those of its centre of mass, so that without springs its
//! energy is linear on a way. One thread at a time.
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

  //! The same path with poses at most `spacing` [m] apart; by default a tenth of the radius.
  Path divide(const Path& path, std::optional<double> spacing = std::nullopt) const;

  //! The highest energy on a way. With springs, what is high for less than a tenth of the radius may be missed.
  struct Peak {
    double energy = 0.0;  //!< [J]
    double at = 0.0;      //!< share of the way, 0..1
  };
  Peak peak(const Pose& from, const Pose& to) const;

  //! Where the energy of a path is highest: between path[edge] and path[edge + 1].
  struct Barrier : Peak {
    std::size_t edge = 0;
  };
  Barrier barrier(const Path& path) const;

  //! Whether a way is allowed up to its end; its start is. Between two poses that are checked no point moves farther
  //! than a hundredth of the object's smallest half extent, unless the clearance there is larger.
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

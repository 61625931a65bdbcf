#pragma once
// Between what the potential energy of the object lies in a cell of poses.

#include <algorithm>
#include <cmath>
#include <vector>

#include "bounds/object_space.hpp"

namespace energymargin::bounds {

//! A simulation kicks the object by the forces at the beginning of a step, and moves it by the velocities at its end.
//! So what it conserves is not the energy T + V, but T + V - h/2 x force x velocity, exactly so on lines and parabolas:
//! an object may pass where the energy alone would stop it. The last term is at most `lag` x sqrt(T).
struct EnergyRange {
  double low, high;  //!< [J]
  double lag = 0.0;  //!< [sqrt(J)]

  //! What the simulation has conserved where the object has at least this kinetic energy [J]: no less than this.
  double passed(double kinetic = 0.0) const {
    const double root = std::max(std::sqrt(kinetic), 0.5 * lag);
    return low + root * (root - lag);
  }
};

//! Of gravity and the constant force on the object, and of the springs between it and what stays where it is.
class PotentialBounds {
 public:
  PotentialBounds(const Problem& problem, std::size_t object, const std::vector<bool>& immovable,
                  const ObjectSpace& space);

  EnergyRange operator()(const PoseCell& cell) const;

  //! At the start, with what the simulation conserves beside the energy there [J].
  double start() const { return start_; }

  //! No lower than anywhere beyond `face` along an axis, on the upper side or the lower; -inf: it may fall for ever.
  double beyond(int axis, bool upper, double face) const;

  const Vector3& load() const { return load_; }  //!< of gravity and the constant force, along free axes [N]
  bool has_springs() const { return !springs_.empty(); }

 private:
  struct Spring {
    Vector3 point;   // in the object's frame
    Vector3 anchor;  // in the world
    double stiffness, rest_length;
    double inverse_mass;  // effective, of the point: at most [1/kg]
  };

  double lag(double force, double inverse_mass) const { return std::sqrt(0.5 * inverse_mass) * step_ * force; }

  const ObjectSpace& space_;
  Vector3 load_, center_;       // of mass, in the object's frame
  double step_, inverse_mass_;  // of the centre of mass [1/kg]
  std::vector<Spring> springs_;
  double start_ = 0.0;
};

}  // namespace energymargin::bounds

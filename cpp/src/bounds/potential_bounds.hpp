#pragma once
// Between what the potential energy of the object lies in a cell of poses.

#include <vector>

#include "bounds/object_space.hpp"

namespace energymargin::bounds {

struct EnergyRange {
  double low, high;  //!< [J]
};

//! Of gravity and the constant force on the object, and of the springs between it and what stays where it is.
class PotentialBounds {
 public:
  PotentialBounds(const Problem& problem, std::size_t object, const std::vector<bool>& immovable,
                  const ObjectSpace& space);

  EnergyRange operator()(const PoseCell& cell) const;

  //! At the start [J].
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
  };

  const ObjectSpace& space_;
  Vector3 load_, center_;  // of mass, in the object's frame
  std::vector<Spring> springs_;
  double start_ = 0.0;
};

}  // namespace energymargin::bounds

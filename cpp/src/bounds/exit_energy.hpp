#pragma once
// Where an object may be outside of its capture set, and how fast it has to be for that.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "bounds/object_space.hpp"
#include "energymargin/region.hpp"

namespace energymargin::bounds {

//! The least kinetic energy of the object with which a state may be outside of a set, and inside of it [J]: 0 where the
//! pose alone may do, inf where it rules that out.
struct CrossingEnergy {
  double outside = 0.0, inside = 0.0;
};

//! What a region of states says about the poses of one object, whatever else moves.
struct ExitEnergy {
  //! Between these two positions is that of the object in the set, along the axes of the world [m].
  using Extent = std::array<Vector3, 2>;

  std::function<CrossingEnergy(const PoseCell&)> crossing;  //!< in a cell of poses
  std::string reason{};                                     //!< why a part of it bounds nothing; empty if there is none
  std::array<bool, 3> depends_on{};                         //!< the axes along which it may be another one elsewhere
  Extent extent{Vector3::Constant(-infinity), Vector3::Constant(infinity)};
};

//! The space outlives what is returned.
ExitEnergy exit_energy(const Subject& subject, const Region& captured, const ObjectSpace& space);

}  // namespace energymargin::bounds

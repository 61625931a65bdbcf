#pragma once
// The units in which distances and densities are counted.

#include "energymargin/problem.hpp"

namespace energymargin::search {

//! How far an object gets in one longest edge: the unit of each kind of coordinate, so that distances and densities
//! are free of units.
struct Scales {
  double position = 1.0;          //!< [m]
  double orientation = 1.0;       //!< [rad]
  double velocity = 1.0;          //!< [m/s]
  double angular_velocity = 1.0;  //!< [rad/s]

  //! From the wrench bounds, the longest edge and the speeds at the start. `object` is an index in the scene.
  Scales(const Problem& problem, std::size_t object);
};

}  // namespace energymargin::search

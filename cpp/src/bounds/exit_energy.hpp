#pragma once
// Where an object may be outside of its capture set, and how fast it has to be for that.

#include <array>
#include <limits>
#include <memory>
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
class ExitEnergy {
 public:
  //! `immovable`: by body of the scene. The space outlives this.
  ExitEnergy(const Problem& problem, const Region& captured, std::size_t object, const std::vector<bool>& immovable,
             const ObjectSpace& space);
  ~ExitEnergy();

  //! `CrossingEnergy::outside` in a cell of poses [J].
  double operator()(const PoseCell& cell) const;

  //! Whether the region may be another one elsewhere along an axis of the world.
  bool depends_on(int axis) const;

  //! The positions in the set, of the point of the object that counts, lie between these two, along the axes of the
  //! world [m]; infinite where there is none.
  std::array<Vector3, 2> extent() const;

  //! Why a part of the region bounds nothing; empty if there is none.
  const std::string& reason() const { return reason_; }

 private:
  class Set;

  std::unique_ptr<const Set> set_;
  std::string reason_;
};

}  // namespace energymargin::bounds

#pragma once
// What is in the object's way: the bodies that stay where they are. Others may give way, and are left out.

#include <vector>

#include "bounds/object_space.hpp"

namespace energymargin::bounds {

//! What is certain about the poses of a cell.
struct Occupancy {
  bool blocked = false;     //!< the object is too deep in an obstacle in all of them
  bool clear = true;        //!< it seems to be in none in any of them
  bool center_free = true;  //!< it seems to be in none in the middle
};

//! The object may be in an obstacle as deep as the simulation lets bodies sink into each other, or as it is at the
//! start. A piece that starts deeper than the simulation would let it come is not held by that obstacle.
class Obstacles {
 public:
  //! The space outlives this.
  Obstacles(const Subject& subject, const ObjectSpace& space);

  Occupancy occupancy(const PoseCell& cell) const;

  //! Whether nothing is different elsewhere along an axis of the world.
  bool same_along(int axis) const;

  //! A distance from a point beyond which there are planes alone [m].
  double extent_from(const Vector3& point) const;

 private:
  struct Pair {
    std::size_t piece;  // of the object
    ConvexPiece obstacle;
    double allowed;  // depth [m]
  };
  struct PlanePair {
    std::size_t piece;
    Plane plane;  // in the world
    double allowed;
  };

  const ObjectSpace& space_;
  std::vector<Pair> pairs_;
  std::vector<PlanePair> planes_;
};

}  // namespace energymargin::bounds

#pragma once
// Which bodies, and which convex pieces of two bodies, are near each other.

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/shapes.hpp"

namespace energymargin {

//! An axis-aligned box [m].
struct Bounds {
  btVector3 low, high;
};

inline Bounds bounds_of(const btCollisionShape& shape, const btTransform& pose) {
  Bounds bounds;
  shape.getAabb(pose, bounds.low, bounds.high);
  return bounds;
}

//! Distance along the axis that separates two boxes most; negative where they penetrate each other [m].
inline double gap_of(const Bounds& a, const Bounds& b) {
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

//! All pairs (a, b), a < b, in no order, whose gap is at most the sum of their `reaches` [m]: sweep and prune (Baraff
//! 1992) along the axis on which the boxes lie farthest apart. It starts anew each time, as sorting a thousand boxes
//! takes 1 % of a step of them.
std::vector<std::pair<std::size_t, std::size_t>> near_pairs(const std::vector<Bounds>& boxes,
                                                            const std::vector<double>& reaches);

//! A piece of each of two bodies, by their indices; a plane counts as one piece.
struct PieceIndices {
  std::size_t a, b;
};

//! Contacts have a compound before a solid, and a solid before a plane: whether `b` comes before `a`.
bool comes_first(const CollisionShape& b, const CollisionShape& a);

//! All pieces of one shape with all of the other, in the order of Bullet's trees of compounds.
std::vector<PieceIndices> all_pieces(const CollisionShape& a, const CollisionShape& b);

//! Boxes around the pieces of a compound `a` and of another body as they stand.
class NearPieces {
 public:
  NearPieces(const CollisionShape& a, const btTransform& pose_a, const CollisionShape& b, const btTransform& pose_b);

  //! Whether the boxes along the world's axes are apart.
  bool apart(const PieceIndices& pieces) const { return gap_of(in_world_a_[pieces.a], in_world_b_[pieces.b]) > 0.0; }

  //! Whether the boxes along the axes of `a` penetrate each other.
  bool meet(const PieceIndices& pieces) const { return gap_of(in_a_[pieces.a], b_in_a_[pieces.b]) <= 0.0; }

 private:
  std::vector<Bounds> in_world_a_, in_world_b_, in_a_, b_in_a_;
};

}  // namespace energymargin

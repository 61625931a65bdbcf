#pragma once
// Which convex pieces of two bodies are near each other.

#include <vector>

#include "physics/contacts/near_bounds.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! A piece of each of two bodies, by their indices; a plane counts as one piece.
struct PieceIndices {
  std::size_t a, b;
};

//! Contacts have a compound before a solid, and a solid before a plane: whether `b` comes before `a`.
bool comes_first(const CollisionShape& b, const CollisionShape& a);

//! All pieces of one shape with all of the other, in the order of Bullet's trees of compounds.
std::vector<PieceIndices> all_pieces(const CollisionShape& a, const CollisionShape& b);

//! Boxes around the pieces of two bodies as they stand, `a` being a compound, or else both one solid or plane.
class NearPieces {
 public:
  NearPieces(const CollisionShape& a, const btTransform& pose_a, const CollisionShape& b, const btTransform& pose_b);

  //! Whether the boxes along the world's axes are apart.
  bool apart(const PieceIndices& pieces) const {
    return culls_ && gap_of(in_world_a_[pieces.a], in_world_b_[pieces.b]) > 0.0;
  }

  //! Whether the boxes along the axes of `a` penetrate each other.
  bool meet(const PieceIndices& pieces) const { return !culls_ || gap_of(in_a_[pieces.a], b_in_a_[pieces.b]) <= 0.0; }

 private:
  bool culls_;
  std::vector<Bounds> in_world_a_, in_world_b_, in_a_, b_in_a_;
};

}  // namespace energymargin

#pragma once
// The pairs of bodies that may touch, where they do, and how far they can go.

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/contacts/collision_filter.hpp"
#include "physics/contacts/face_contacts.hpp"
#include "physics/contacts/piece_pair.hpp"
#include "physics/motion.hpp"

namespace energymargin {

//! Distance along the axis that separates two boxes most; negative where they penetrate each other [m].
inline double gap_of(const Bounds& a, const Bounds& b) {
  const btVector3 gap_a = a.low - b.high;
  const btVector3 gap_b = b.low - a.high;
  return std::max(std::max(std::max(gap_a.x(), gap_b.x()), std::max(gap_a.y(), gap_b.y())),
                  std::max(gap_a.z(), gap_b.z()));
}

//! All pairs (a, b), a < b, in no order, whose gap is at most the sum of their `reaches` [m]: sweep and prune (Baraff
//! 1992) along the axis on which the boxes lie farthest apart. Sorting anew takes 1 % of a step.
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

//! Boxes around the pieces of a compound `a` and of another body as they stand; those along the world's axes outlive
//! it.
class NearPieces {
 public:
  NearPieces(const CollisionShape& a, const btTransform& pose_a, const std::vector<Bounds>& in_world_a,
             const CollisionShape& b, const btTransform& pose_b, const std::vector<Bounds>& in_world_b);

  //! Whether the boxes along the world's axes are farther apart than that [m].
  bool apart(const PieceIndices& pieces, double reach) const {
    return gap_of(in_world_a_[pieces.a], in_world_b_[pieces.b]) > reach;
  }

  //! Whether the boxes along the axes of `a` are as near as that [m].
  bool meet(const PieceIndices& pieces, double reach) const {
    return gap_of(in_a_[pieces.a].bounds, b_in_a_[pieces.b]) <= reach;
  }

 private:
  const std::vector<Bounds>&in_world_a_, &in_world_b_;
  const std::vector<ConvexPiece>& in_a_;
  std::vector<Bounds> b_in_a_;
};

//! Two bodies whose bounds are, or have been, near each other.
struct CollisionPair {
  std::size_t a, b;                   // indices in the scene, a < b
  std::size_t first, second;          // the same, in the order of contacts
  ContactReach near;                  // of their contacts
  double friction;                    // coefficient of their contacts
  bool bounces;                       // whether they part with a share of the speed at which they meet
  double gap_share;                   // of a gap, from the second to where friction acts: by their inverse masses
  double gap = 0.0;                   // of the bounds, negative where they penetrate each other [m]
  bool remembers = false;             // whether one of `solids` knows where its last search ended
  std::vector<PieceIndices> order{};  // of contacts
  std::vector<SolidPair> solids{};    // in that order; none with a plane
  std::vector<PiecePair> pieces{};    // for continuous collision, made when it first asks
};

//! Collision detection. Of a few bodies every pair is kept from the start; those out of a contact's reach cost no more
//! than a test of their bounds. Of many, pairs are kept once they come near each other.
class CollisionPairs {
 public:
  //! Up to how many bodies every pair is kept.
  static constexpr std::size_t few_bodies = 32;

  //! `poses` are Bullet's frames of the scene's bodies, in its order; both outlive this.
  CollisionPairs(const Scene& scene, const std::vector<btTransform>& poses);
  CollisionPairs(const CollisionPairs&) = delete;
  CollisionPairs& operator=(const CollisionPairs&) = delete;

  //! Forgets all contacts, and all directions that separated pieces.
  void forget();

  //! Finds the contacts of the bodies as they stand. Where a gap would close in the next `duration` [s] with
  //! `velocities`, each at the index of its body, it is that of where the bodies come nearest to each other.
  void update(const std::vector<Velocity>& velocities, double duration);

  //! The time until bodies first touch that will bounce, at most the `duration` of the last `update` [s].
  double until_touch() const { return until_touch_; }

  //! All contacts, pair by pair in the order of their bodies.
  std::vector<ContactPoint>& points() { return points_; }
  const std::vector<ContactPoint>& points() const { return points_; }

  //! Whether a contact bears, or its bodies are as near as those that touch: what bounces has contacts before that.
  bool touches(const ContactPoint& point) const {
    return point.normal_impulse > 0.0 || point.distance <= contact_reach(point.a, point.b);
  }

  //! The share, from 0 to 1, of the next `duration` [s] for which all bodies can go on with `velocities`, each at the
  //! index of its body, before one is too deep in another. Bounds are those of the last `update`.
  double safe_share(const std::vector<Velocity>& velocities, double duration);

  //! Adds contacts where pieces blocked each other at once in the last `safe_share`; false if none did. Their points
  //! alone, where they stand, need not tell that they turn into each other.
  bool add_blocking();

  //! Pairs of bodies within reach of a contact as they stand, by their indices.
  std::vector<std::pair<std::size_t, std::size_t>> near();

  //! Closest points of two bodies as they stand, up to `reach` [m] beyond that of a contact; none are found of
  //! compounds whose boxes are apart unless that is above 0. The normal points to `a`.
  std::optional<ClosestPoints> closest(std::size_t a, std::size_t b, double reach) const;

 private:
  double contact_reach(std::size_t a, std::size_t b) const { return std::min(reaches_[a], reaches_[b]); }

  //! A contact at an edge.
  struct PointAtEdge {
    std::size_t point;
    FaceContacts::Edge edge;
  };

  // How two bodies go on, where one asks for contacts.
  struct Ways {
    Sweep a, b;
  };
  //! Where points first meet on the ways: the share of these, and by how much the points would close on all of them
  //! [m].
  struct Touch {
    double share, closing;
  };
  static Touch first_touch(const std::vector<FacePoint>& points, const btVector3& normal, const Ways& ways,
                           double share, double nearest);
  double look_ahead(CollisionPair& pair, std::size_t k, const Ways& ways, btVector3& normal);
  const std::vector<FacePoint>& points_of(CollisionPair& pair, std::size_t k, const btTransform& pose_a,
                                          const btTransform& pose_b, btVector3& normal);
  void add_points(CollisionPair& pair, std::size_t k, const Ways& ways);

  //! The contacts of two pieces, from `begin` to `end` among all.
  struct PieceContacts {
    std::size_t begin, end;
    const CollisionPair* pair;
    std::size_t pieces;  // in the pair's order
  };
  //! A piece of a body; a plane has no solid.
  struct Side {
    std::size_t body, piece;
    const InnerShape* solid;
  };
  Side side(const PieceContacts& contacts, bool first) const;
  btTransform pose_of(const Side& side) const;
  void drop_covered(const PieceContacts& at_edge, const PieceContacts& on_face, std::vector<bool>& drops) const;

  void set_bounds();
  void find(const std::vector<double>& reaches);
  void add(std::size_t a, std::size_t b);
  void detect(CollisionPair& pair);
  //! Whether a body that is pressed into another meets the next one, whose face is flush, in an edge that is no step.
  bool is_seam(const PointAtEdge& at) const;
  void drop_seams();
  void add_meeting(const CollisionPair& pair, PiecePair& pieces, const Sweep& a, const Sweep& b);
  static void drop(CollisionPair& pair);
  const std::vector<Bounds>& pieces_at(std::size_t body);
  Sweep sweep(std::size_t body, const Velocity& velocity, double duration) const;

  const Scene& scene_;
  CollisionFilter filter_;
  const std::vector<btTransform>& poses_;
  std::vector<const CollisionShape*> shapes_;
  std::vector<Bounds> bounds_;                     // of the bodies
  std::vector<std::vector<Bounds>> piece_bounds_;  // of those of the bodies that were asked for since `set_bounds`
  std::vector<double> reaches_;                    // of their contacts [m]
  std::vector<double> early_reaches_;              // the same, where they bounce or give way [m]
  std::vector<double> travels_;                    // of their points in a substep, at most [m]
  std::vector<CollisionPair> pairs_;
  bool all_kept_;
  std::vector<bool> found_;  // by a * (number of bodies) + b: that a sweep has found the pair since `forget`
  FaceContacts faces_;
  std::vector<FacePoint> on_plane_;
  std::vector<PointAtEdge> edges_;
  std::vector<PieceContacts> groups_;
  const std::vector<Velocity>* velocities_ = nullptr;  // of the last `update`
  double duration_ = 0.0, until_touch_ = 0.0;          // of it [s]
  std::vector<ContactPoint> blocking_;
  std::vector<ContactPoint> points_;
};

}  // namespace energymargin

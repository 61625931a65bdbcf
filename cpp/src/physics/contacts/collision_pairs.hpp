#pragma once
// The pairs of bodies that may touch, where they do, and how far they can go.

#include <utility>
#include <vector>

#include "physics/contacts/collision_filter.hpp"
#include "physics/contacts/face_contacts.hpp"
#include "physics/contacts/near.hpp"
#include "physics/contacts/piece_pair.hpp"
#include "physics/motion.hpp"

namespace energymargin {

//! Two bodies whose bounds are, or have been, near each other.
struct CollisionPair {
  std::size_t a, b;                   // indices in the scene, a < b
  std::size_t first, second;          // the same, in the order of contacts
  double reach;                       // distance from which on they do not touch [m]
  double friction;                    // coefficient of their contacts
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

  //! Finds the contacts of the bodies as they stand.
  void update();

  //! All contacts, pair by pair in the order of their bodies.
  std::vector<ContactPoint>& points() { return points_; }
  const std::vector<ContactPoint>& points() const { return points_; }

  //! The share, from 0 to 1, of the next `duration` [s] for which all bodies can go on with `velocities`, each at the
  //! index of its body, before one is too deep in another. Bounds are those of the last `update`.
  double safe_share(const std::vector<Velocity>& velocities, double duration);

  //! Pairs of bodies within reach of a contact as they stand, by their indices.
  std::vector<std::pair<std::size_t, std::size_t>> near();

  //! Closest points of two bodies as they stand, up to `reach` [m] beyond that of a contact; none are found of
  //! compounds whose boxes are apart unless that is above 0. The normal points to `a`.
  std::optional<ClosestPoints> closest(std::size_t a, std::size_t b, double reach) const;

 private:
  void set_bounds();
  void find(const std::vector<double>& reaches);
  void add(std::size_t a, std::size_t b);
  void detect(CollisionPair& pair);
  static void drop(CollisionPair& pair);
  Sweep sweep(std::size_t body, const Velocity& velocity, double duration) const;

  const Scene& scene_;
  CollisionFilter filter_;
  const std::vector<btTransform>& poses_;
  std::vector<const CollisionShape*> shapes_;
  std::vector<Bounds> bounds_;   // of the bodies
  std::vector<double> reaches_;  // of their contacts [m]
  std::vector<double> travels_;  // of their points in a substep, at most [m]
  std::vector<CollisionPair> pairs_;
  bool all_kept_;
  std::vector<bool> found_;  // by a * (number of bodies) + b: that a sweep has found the pair since `forget`
  FaceContacts faces_;
  std::vector<FacePoint> on_plane_;
  std::vector<ContactPoint> points_;
};

}  // namespace energymargin

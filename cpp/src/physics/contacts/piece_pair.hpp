#pragma once
// Two convex pieces that move, and how far they can.

#include <optional>

#include "physics/contacts/solid_pair.hpp"
#include "physics/motion.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! Two pieces may penetrate each other a little: by less than their margins, so that the separating direction is known,
//! and by less than a third of the thinner one's half extent, so that they are pushed out to the side where they came
//! from.
class PiecePair {
 public:
  PiecePair(const ConvexPiece& a, const ConvexPiece& b, bool compliant = false);

  //! Forgets which direction separated them, for a new rollout.
  void forget() {
    solids_.forget();
    has_normal_ = starts_deep_ = false;
    first_query_ = true;
  }

  //! The share, from 0 to 1, of their sweeps that they can go without passing into each other: conservative advancement
  //! (Mirtich 1996), where no direction separates them on the whole way.
  double safe_share(const Sweep& a, const Sweep& b);

 private:
  struct Sweeps;

  std::optional<ClosestPoints> find_closest(const btTransform& a, const btTransform& b);
  std::optional<ClosestPoints> closest_at(const btTransform& a, const btTransform& b);
  void set_normal(const btVector3& normal, const btTransform& a, const btTransform& b);
  bool separates_as_before(const Sweeps& sweeps);
  void find_normal(const Sweeps& sweeps);
  double gap(const Sweeps& sweeps, double share) const;
  double gap(const btTransform& a, const btTransform& b, const btVector3& normal) const;
  bool stay_separate(const Sweeps& sweeps, double now) const;
  bool slide(const Sweeps& sweeps, double now);
  double approach(const Sweeps& sweeps) const;
  double next_check(const Sweeps& sweeps, double share, double room) const;
  double advance(const Sweeps& sweeps, double now);
  double linear_share(const Sweeps& sweeps, double now) const;
  double least(double now) const;

  ConvexPiece a_, b_;
  SolidPair solids_;
  double allowed_;                       // penetration [m]
  btVector3 normal_;                     // from b to a, the last that separated them, if `has_normal_`
  btVector3 normal_of_a_, normal_of_b_;  // the same in the frames of the bodies, as they stood then
  bool has_normal_ = false;
  bool first_query_ = true;   // nothing was asked since `forget`
  bool starts_deep_ = false;  // deeper than they may be, and still are
};

}  // namespace energymargin

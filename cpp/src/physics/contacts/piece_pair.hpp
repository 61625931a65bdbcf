#pragma once
// Two convex pieces that move, and how far they can.

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/contacts/solid_pair.hpp"
#include "physics/motion.hpp"
#include "physics/shapes.hpp"
#include "scene/body_constants.hpp"

namespace energymargin {

//! Two pieces may penetrate each other a little: by less than their margins, so that the separating direction is known,
//! and by less than half of the thinner one's half extent, so that they are pushed out to where they came from.
class PiecePair {
 public:
  PiecePair(const ConvexPiece& a, const ConvexPiece& b, bool compliant = false)
      : a_(a),
        b_(b),
        solids_(*a.shape, *b.shape),
        compliant_(compliant),
        allowed_(compliant ? compliant_penetration(a.half_extent, b.half_extent) / pressed_deeper
                           : allowed_penetration(solids_.margins(), a.half_extent, b.half_extent)),
        deepest_(pressed_deeper * allowed_) {}

  //! Forgets which direction separated them, for a new rollout.
  void forget() {
    solids_.forget();
    has_normal_ = starts_deep_ = false;
    first_query_ = true;
  }

  //! The share, from 0 to 1, of their sweeps that they can go without passing into each other: conservative advancement
  //! (Mirtich 1996), where no direction separates them on the whole way.
  double safe_share(const Sweep& a, const Sweep& b) {
    const Sweeps sweeps{a, b};
    if (has_normal_ && !starts_deep_ && separates_as_before(sweeps)) return 1.0;
    const std::optional<ClosestPoints> closest = find_closest(a.start, b.start);
    if (!closest) find_normal(sweeps);
    const double now = closest ? closest->distance : gap(sweeps, 0.0);
    if (first_query_) starts_deep_ = now < -deep_start * allowed_;
    first_query_ = false;
    starts_deep_ = starts_deep_ && now < -allowed_;
    if (starts_deep_ || stay_separate(sweeps, now) || slide(sweeps, now)) return 1.0;
    return closest ? advance(sweeps, now) : linear_share(sweeps, now);
  }

  //! Where two pieces whose sweeps block each other meet on the way, as they stand before: points of theirs, and the
  //! normal from b to a. Unset if they are in each other by more than their margins.
  struct Meeting {
    btVector3 on_a, on_b, normal;
  };
  std::optional<Meeting> meeting(const Sweep& a, const Sweep& b) {
    for (double share = 1.0; share > least_meeting; share *= 0.5) {
      const btTransform pose_a = a.at(share), pose_b = b.at(share);
      const std::optional<ClosestPoints> closest = closest_at(pose_a, pose_b);
      if (!closest) continue;
      const btVector3 on_a = a.start * pose_a.invXform(closest->on_b + closest->normal * closest->distance);
      return Meeting{on_a, b.start * pose_b.invXform(closest->on_b), closest->normal};
    }
    return std::nullopt;
  }

 private:
  static constexpr double least_meeting = 0.1;  // share of the sweeps

  // Shares of the allowed penetration.
  static constexpr double in_contact = 0.5;  // where a motion ends
  static constexpr double deeper = 0.1;      // by which pieces beyond that may sink in a substep,
  static constexpr double of_room = 0.25;    // and not by more of what is left to the deepest: something is always left
  static constexpr double deep_start = 1.5;  // pieces that begin a rollout deeper are left to their contacts

  static constexpr double no_bend = 1e-8;   // of a square speed: a change of it that hardly counts
  static constexpr double fine_turn = 0.3;  // rad, between two checks of pieces that turn
  static constexpr int most_checks = 40;

  struct Sweeps {
    const Sweep &a, &b;
  };

  static btVector3 support(const InnerShape& shape, const btTransform& pose, const btVector3& direction) {
    return pose(shape.support(direction * pose.getBasis()));
  }

  // Closest points of the bodies, whose normal counts from now on; none where the inner shapes penetrate each other.
  std::optional<ClosestPoints> find_closest(const btTransform& a, const btTransform& b) {
    const std::optional<ClosestPoints> closest = closest_at(a, b);
    if (closest) set_normal(closest->normal, a, b);
    return closest;
  }
  std::optional<ClosestPoints> closest_at(const btTransform& a, const btTransform& b) {
    return solids_.closest(a_.pose(a), b_.pose(b), BT_LARGE_FLOAT, Penetration::ignored);
  }
  void set_normal(const btVector3& normal, const btTransform& a, const btTransform& b) {
    has_normal_ = true;
    normal_ = normal;
    normal_of_a_ = normal * a.getBasis();
    normal_of_b_ = normal * b.getBasis();
  }
  // A face takes its normal along as it turns; one from which they have turned may tell nothing. If neither normal
  // separates the pieces, the one that tells more counts: the other piece may have spun.
  bool separates_as_before(const Sweeps& sweeps) {
    const btVector3 of_b = sweeps.b.start.getBasis() * normal_of_b_;
    const btVector3 of_a = sweeps.a.start.getBasis() * normal_of_a_;
    for (const btVector3& normal : {of_b, of_a}) {
      normal_ = normal;
      const double now = gap(sweeps, 0.0);
      if (now >= -allowed_ && stay_separate(sweeps, now)) return true;
    }
    if (gap(sweeps.a.start, sweeps.b.start, of_b) > gap(sweeps.a.start, sweeps.b.start, of_a)) normal_ = of_b;
    return false;
  }
  // Where the inner shapes penetrate, the direction counts that separated them, or else that of least penetration. What
  // gives way may be in so deep for long, and go over the edge of the next piece.
  void find_normal(const Sweeps& sweeps) {
    if (has_normal_ && !compliant_) return;
    const btTransform pose_a = a_.pose(sweeps.a.start);
    const btTransform pose_b = b_.pose(sweeps.b.start);
    const auto closest = solids_.deepest(pose_a, pose_b);
    const btVector3 offset = pose_a.getOrigin() - pose_b.getOrigin();
    btVector3 normal(0, 0, 1);
    if (closest) {
      normal = closest->normal;
    } else if (!offset.fuzzyZero()) {
      normal = offset.normalized();
    }
    set_normal(normal, sweeps.a.start, sweeps.b.start);
  }
  // The distance of the pieces along the normal.
  double gap(const Sweeps& sweeps, double share) const { return gap(sweeps.a.at(share), sweeps.b.at(share), normal_); }
  double gap(const btTransform& a, const btTransform& b, const btVector3& normal) const {
    const btVector3 apart = support(solids_.a(), a_.pose(a), -normal) - support(solids_.b(), b_.pose(b), normal);
    return normal.dot(apart) - solids_.margins();
  }
  // Whether the normal tells that they never come too close.
  bool stay_separate(const Sweeps& sweeps, double now) const {
    const double bound = least(now);
    if (now - approach(sweeps) >= bound) return true;
    // Between two checks points are off a straight way by an eighth of what their sweeps bend.
    const double bend = sweeps.a.bend(a_.reach) + sweeps.b.bend(b_.reach);
    const double checks = 1.0 + std::floor(std::sqrt(0.125 * bend / (deeper * allowed_)));
    if (!(checks <= most_checks)) return false;
    for (double i = 1.0; i <= checks; ++i) {
      if (gap(sweeps, i / checks) < bound) return false;
    }
    return true;
  }
  // Whether a normal that turns tells it: one that stays tells of a face that turns only that its far end comes closer.
  // Between two checks the distance is less by no more than what the travel makes of the normal's turn.
  bool slide(const Sweeps& sweeps, double now) {
    const double bound = least(now);
    const double travel = (sweeps.a.linear - sweeps.b.linear).length() + sweeps.a.angular.length() * a_.reach +
                          sweeps.b.angular.length() * b_.reach;
    const double turn = sweeps.a.angular.length() + sweeps.b.angular.length();
    const double across = 0.25 * travel / (deeper * allowed_);
    const double checks = 1.0 + std::floor(std::max(turn / fine_turn, std::sqrt(across * turn)));
    if (!(checks <= most_checks)) return false;
    const auto turning = [&](const Sweep& face) {
      for (double i = 1.0; i <= checks; ++i) {
        if (gap(sweeps.a.at(i / checks), sweeps.b.at(i / checks), face.turned(normal_, i / checks)) < bound)
          return false;
      }
      return true;
    };
    if (turning(sweeps.a) || turning(sweeps.b)) return true;
    btVector3 normal = normal_;
    for (double i = 1.0; i <= checks; ++i) {
      const std::optional<ClosestPoints> closest = closest_at(sweeps.a.at(i / checks), sweeps.b.at(i / checks));
      if (!closest || closest->distance < bound) return false;
      if ((closest->normal - normal).length() * across > checks) return false;
      normal = closest->normal;
    }
    return true;
  }
  // How much closer they can come along the normal on the whole way [m].
  double approach(const Sweeps& sweeps) const {
    return sweeps.a.along(-normal_) + sweeps.b.along(normal_) + sweeps.a.angular.cross(normal_).length() * a_.reach +
           sweeps.b.angular.cross(normal_).length() * b_.reach;
  }
  // A share so near that they come no closer by then than `room` [m]: along the normal a point moves as fast as it does
  // now, and for every turn since by that turn x its arm x its turning faster.
  double next_check(const Sweeps& sweeps, double share, double room) const {
    double speed = 0.0;
    double acceleration = 0.0;
    const auto add = [&](const ConvexPiece& piece, const InnerShape& shape, const Sweep& sweep,
                         const btVector3& direction) {
      const btVector3 across = direction.cross(sweep.angular);
      const btTransform pose = sweep.at(share);
      const btVector3 arm = support(shape, piece.pose(pose), across) - pose.getOrigin();
      speed += across.dot(arm) + direction.dot(sweep.screw ? sweep.turned(sweep.linear, share) : sweep.linear);
      acceleration +=
          sweep.angular.length() * (across.length() * piece.reach + (sweep.screw ? sweep.linear.length() : 0.0));
    };
    add(a_, solids_.a(), sweeps.a, -normal_);
    add(b_, solids_.b(), sweeps.b, normal_);
    // The root of room = speed x + acceleration x^2 / 2, in which near numbers cancel if acceleration hardly counts.
    const double bend = 2.0 * acceleration * room;
    if (bend > no_bend * speed * speed) return share + (std::sqrt(speed * speed + bend) - speed) / acceleration;
    return speed > 0.0 ? share + room / speed : 1.0;
  }
  // Each iteration goes as far as the pieces are sure not to meet.
  double advance(const Sweeps& sweeps, double now) {
    const double bound = least(now);
    const double contact = std::min(-in_contact * allowed_, 0.5 * (now + bound));  // where the motion ends
    double distance = now;
    double share = 0.0;
    for (int i = 0; i < most_checks && distance > contact; ++i) {
      const double safe = share;
      share = next_check(sweeps, share, distance - bound);
      if (share >= 1.0) return 1.0;
      const std::optional<ClosestPoints> closest = find_closest(sweeps.a.at(share), sweeps.b.at(share));
      if (!closest) return safe;
      distance = closest->distance;
    }
    return share;
  }
  // The share along a normal that stays.
  double linear_share(const Sweeps& sweeps, double now) const {
    const double end = gap(sweeps, 1.0);
    return end >= least(now) ? 1.0 : std::clamp((now - least(now)) / (now - end), 0.0, 1.0);
  }
  // The least distance that a motion from `now` may lead to. If nothing were left, what rolls on a corner would stay.
  double least(double now) const {
    if (now > -in_contact * allowed_) return -allowed_;
    return now - std::max(0.0, std::min(deeper * allowed_, of_room * (now + deepest_)));
  }

  ConvexPiece a_, b_;
  SolidPair solids_;
  bool compliant_;
  double allowed_, deepest_;             // penetration, and where something presses [m]
  btVector3 normal_;                     // from b to a, the last that separated them, if `has_normal_`
  btVector3 normal_of_a_, normal_of_b_;  // the same in the frames of the bodies, as they stood then
  bool has_normal_ = false;
  bool first_query_ = true;   // nothing was asked since `forget`
  bool starts_deep_ = false;  // deeper than they may be, and still are
};

}  // namespace energymargin

#pragma once
// The poses of one object that are looked at, in a plane, along lines, or of a ball inside of it; and between what its
// potential energy lies there; and where it may be outside of its capture set, and how fast it has to be for that.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "bounds/barrier_bound.hpp"
#include "bounds/convex_piece.hpp"

namespace energymargin::bounds {

//! Position of the reference point [m], and the turn from the start about the one free axis [rad].
using Coordinates = Eigen::Vector4d;

inline constexpr int turn_axis = 3;  // of the coordinates

//! All coordinates between two.
struct PoseCell {
  Coordinates low = Coordinates::Zero();
  Coordinates high = Coordinates::Zero();

  Coordinates center() const { return 0.5 * (low + high); }
  Coordinates half() const { return 0.5 * (high - low); }
};

//! How far a point at a distance of 1 moves by a turn of up to so much.
inline double chord(double turn) { return 2.0 * portable::sin(0.5 * std::min(turn, pi)); }

//! A piece of the object, in its frame.
struct ObjectPiece {
  ConvexPiece piece;
  double reach;       //!< of its farthest point from the axis of turns [m]
  ConvexPiece whole;  //!< the piece that this one lies in: as deep as that one may be in a body, this one may be
};

//! Coordinates of an object. One that is locked to turns about one axis, or to none, has its own pieces. One that turns
//! freely is a ball inside of it: what holds the ball holds the object, whatever its turn.
class ObjectSpace {
 public:
  explicit ObjectSpace(const Subject& subject) {
    const Body& body = subject.body();
    const Vector3 center = subject.problem.scene.inertial(subject.object).center;
    const BodyState start = subject.at(subject.object);
    const double turns = body.angular_factor.sum();
    any_turn_ = std::holds_alternative<Sphere>(body.shape) || turns > 1.0;
    const std::vector<ConvexPiece> pieces = convex_pieces(body.shape, Pose{}, subject.problem.scene.stepping().margin);
    reference_ = center;
    if (any_turn_ && !pieces.empty()) {
      const auto thinner = [](const ConvexPiece& a, const ConvexPiece& b) {
        return a.inner_radius() < b.inner_radius();
      };
      const ConvexPiece& widest = *std::max_element(pieces.begin(), pieces.end(), thinner);
      reference_ = widest.center();
      pieces_.push_back(
          {ConvexPiece(Sphere{widest.inner_radius()}, {reference_, Quaternion::Identity()}), 0.0, widest});
    } else if (!any_turn_) {
      for (const ConvexPiece& piece : pieces) {
        pieces_.push_back({piece, (piece.center() - reference_).norm() + piece.radius(), piece});
      }
    }
    if (turns == 1.0) axis_ = body.angular_factor;
    // A locked axis holds the centre of mass; another point moves along it when the object turns.
    const bool at_center = reference_ == center;
    for (int axis = 0; axis < 3; ++axis) {
      free_[static_cast<std::size_t>(axis)] = body.linear_factor[axis] != 0.0 || !at_center;
    }
    free_[turn_axis] = !any_turn_ && turns == 1.0;
    orientation_ = start.orientation;
    start_.head<3>() = start.position + start.orientation * reference_;
    for (const ObjectPiece& piece : pieces_) radius_ = std::max(radius_, piece.reach + piece.piece.radius());
  }

  //! Of the object's frame, at a turn from the start.
  Pose pose(const Coordinates& at) const {
    const Quaternion turned = portable::turn(at[turn_axis], axis_) * orientation_;
    return {at.head<3>() - turned * reference_, turned};
  }

  Coordinates start() const { return start_; }
  const Vector3& reference() const { return reference_; }  //!< of turns, in the object's frame [m]
  bool free(int axis) const { return free_[static_cast<std::size_t>(axis)]; }
  bool any_turn() const { return any_turn_; }
  const std::vector<ObjectPiece>& pieces() const { return pieces_; }
  double radius() const { return radius_; }  //!< of the farthest point from the axis of turns [m]

  //! The inner radius of the thinnest piece; 0 without pieces [m].
  double thickness() const {
    double least = pieces_.empty() ? 0.0 : infinity;
    for (const ObjectPiece& piece : pieces_) least = std::min(least, piece.piece.inner_radius());
    return least;
  }

  //! How far a point of the object is from where `pose` has it, at most, in a cell, along each axis of the world [m].
  Vector3 slack(const Coordinates& half, const Vector3& point) const {
    const double arm = (point - reference_).norm();
    return half.head<3>() + Vector3::Constant(arm * (any_turn_ ? 2.0 : chord(half[turn_axis])));
  }

 private:
  Vector3 reference_ = Vector3::Zero();  // in the object's frame
  Quaternion orientation_;               // at the start
  Vector3 axis_ = Vector3::UnitZ();      // of turns, in the world
  Coordinates start_ = Coordinates::Zero();
  std::array<bool, 4> free_{};
  bool any_turn_ = false;
  std::vector<ObjectPiece> pieces_;
  double radius_ = 0.0;
};

//! A simulation kicks the object by the forces at the beginning of a step, and moves it by the velocities at its end.
//! So what it conserves is not the energy T + V, but T + V - h/2 x force x velocity, exactly so on lines and parabolas:
//! an object may pass where the energy alone would stop it. The last term is at most `lag` x sqrt(T).
struct EnergyRange {
  double low, high;  //!< [J]
  double lag = 0.0;  //!< [sqrt(J)]

  //! What the simulation has conserved where the object has at least this kinetic energy [J]: no less than this.
  double passed(double kinetic = 0.0) const {
    const double root = std::max(std::sqrt(kinetic), 0.5 * lag);
    return low + root * (root - lag);
  }
};

//! Of gravity and the constant force on the object, and of the springs between it and what stays where it is.
class PotentialBounds {
 public:
  PotentialBounds(const Subject& subject, const ObjectSpace& space)
      : space_(space),
        center_(subject.problem.scene.inertial(subject.object).center),
        step_(subject.problem.scene.stepping().step),
        inverse_mass_(1.0 / subject.body().mass) {
    const Scene& scene = subject.problem.scene;
    const std::size_t object = subject.object;
    const Body& body = subject.body();
    load_ = body.linear_factor.cwiseProduct(body.mass * scene.gravity() + body.force);
    const double turning = 1.0 / scene.inertial(object).moments.minCoeff();
    for (const auto& spring : scene.springs()) {
      const bool first = scene.index(spring.body_a) == object;
      const std::size_t other = scene.index(first ? spring.body_b : spring.body_a);
      if ((!first && scene.index(spring.body_b) != object) || !subject.immovable[other]) continue;
      const BodyState at = subject.at(other);
      const Vector3 anchor = at.position + at.orientation * (first ? spring.point_b : spring.point_a);
      const Vector3 point = first ? spring.point_a : spring.point_b;
      const double inverse_mass = inverse_mass_ + turning * (point - center_).squaredNorm();
      springs_.push_back({point, anchor, spring.stiffness, spring.rest_length, inverse_mass});
    }
    // The start itself, whose turn is known.
    const Pose pose = space.pose(space.start());
    const BodyState moving = subject.at(object);
    start_ = -load_.dot(pose.position + pose.orientation * center_);
    double power = load_.dot(state_at_point(center_, moving).velocity);
    for (const Spring& spring : springs_) {
      const Vector3 span = pose.position + pose.orientation * spring.point - spring.anchor;
      const double stretch = span.norm() - spring.rest_length;
      start_ += 0.5 * spring.stiffness * stretch * stretch;
      power -= spring.stiffness * stretch * span.normalized().dot(state_at_point(spring.point, moving).velocity);
    }
    start_ += 0.5 * step_ * std::max(power, 0.0);
  }

  EnergyRange operator()(const PoseCell& cell) const {
    const Pose pose = space_.pose(cell.center());
    const Coordinates half = cell.half();
    const double middle = -load_.dot(pose.position + pose.orientation * center_);
    const double slack = load_.cwiseAbs().dot(space_.slack(half, center_));
    EnergyRange range{middle - slack, middle + slack, lag(load_.norm(), inverse_mass_)};
    for (const Spring& spring : springs_) {
      const double length = (pose.position + pose.orientation * spring.point - spring.anchor).norm();
      const double stretch = std::abs(length - spring.rest_length);
      const double change = space_.slack(half, spring.point).norm();
      range.low += 0.5 * spring.stiffness * std::pow(std::max(stretch - change, 0.0), 2);
      range.high += 0.5 * spring.stiffness * std::pow(stretch + change, 2);
      range.lag += lag(spring.stiffness * (stretch + change), spring.inverse_mass);
    }
    return range;
  }

  //! At the start, with what the simulation conserves beside the energy there [J].
  double start() const { return start_; }

  //! No lower than anywhere beyond `face` along an axis, on the upper side or the lower; -inf: it may fall for ever.
  double beyond(int axis, bool upper, double face) const {
    if (axis == turn_axis || (load_.isZero(0.0) && springs_.empty())) return 0.0;
    Vector3 others = load_;
    others[axis] = 0.0;
    const bool rises = upper ? load_[axis] <= 0.0 : load_[axis] >= 0.0;
    if (!others.isZero(0.0) || !rises) return -infinity;
    const Vector3 slack = space_.slack(Coordinates::Zero(), center_);
    // What springs have there is more than what they lag by, but for stiff ones.
    double stiffness = 0.0;
    for (const Spring& spring : springs_) stiffness += spring.stiffness * spring.inverse_mass * step_ * step_;
    if (stiffness > 2.0) return -infinity;
    const double low = -load_[axis] * face - std::abs(load_[axis]) * slack[axis];
    return EnergyRange{low, low, std::sqrt(2.0) * lag(load_.norm(), inverse_mass_)}.passed();
  }

  const Vector3& load() const { return load_; }  //!< of gravity and the constant force, along free axes [N]
  bool has_springs() const { return !springs_.empty(); }

 private:
  struct Spring {
    Vector3 point;   // in the object's frame
    Vector3 anchor;  // in the world
    double stiffness, rest_length;
    double inverse_mass;  // effective, of the point: at most [1/kg]
  };

  double lag(double force, double inverse_mass) const { return std::sqrt(0.5 * inverse_mass) * step_ * force; }

  const ObjectSpace& space_;
  Vector3 load_, center_;       // of mass, in the object's frame
  double step_, inverse_mass_;  // of the centre of mass [1/kg]
  std::vector<Spring> springs_;
  double start_ = 0.0;
};

//! The least kinetic energy of the object outside of a set, and inside of it [J]: 0 where any will do, inf where none.
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

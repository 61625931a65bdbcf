#pragma once
// The energy landscape of an object that is moved slowly while everything else stays (Definitions 1 and 2).

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "base/portable.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/problem.hpp"
#include "physics/free_space.hpp"

namespace energymargin::quasistatic {

//! Poses from the start on; from one to the next the object moves evenly, and turns the shorter way.
using Path = std::vector<Pose>;

//! The pose at a share `t` of the way, 0..1.
inline Pose interpolate(const Pose& from, const Pose& to, double t) {
  return {(1.0 - t) * from.position + t * to.position,
          portable::slerp(from.orientation, t, to.orientation).normalized()};
}

//! Angle between two orientations, 0..pi [rad].
inline double angle(const Quaternion& a, const Quaternion& b) {
  return 2.0 * portable::acos(std::min(1.0, std::abs(a.dot(b))));
}

//! The potential energy of one body while everything else stays where it is: E of Definition 2.
class Potential {
 public:
  //! `body` is an index in the scene; `state` says where everything else is.
  Potential(const Scene& scene, const State& state, std::size_t body)
      : load_(scene.bodies()[body].mass * scene.gravity() + scene.bodies()[body].force),
        center_(scene.inertial(body).center) {
    const Kinematics kinematics(scene);
    for (const Spring& spring : scene.springs()) {
      const std::size_t a = scene.index(spring.body_a);
      const std::size_t b = scene.index(spring.body_b);
      if (a != body && b != body) continue;
      const BodyState other = kinematics(state.data(), a == body ? b : a);
      const Vector3 anchor = other.position + other.orientation * (a == body ? spring.point_b : spring.point_a);
      springs_.push_back({a == body ? spring.point_a : spring.point_b, anchor, spring.stiffness, spring.rest_length});
    }
  }

  //! Of gravity, the body's constant force and the springs on it, with its zero at the world's origin [J].
  double operator()(const Pose& pose) const {
    double energy = -load_.dot(pose.position + pose.orientation * center_);
    for (const End& end : springs_) {
      const double stretch = (pose.position + pose.orientation * end.point - end.anchor).norm() - end.rest_length;
      energy += 0.5 * end.stiffness * stretch * stretch;
    }
    return energy;
  }

  //! What pulls at the body [N]: minus the slope of the energy in the position.
  Vector3 force(const Pose& pose) const {
    Vector3 force = load_;
    for (const End& end : springs_) {
      const Vector3 span = pose.position + pose.orientation * end.point - end.anchor;
      const double length = span.norm();
      if (length > 0.0) force -= end.stiffness * (length - end.rest_length) / length * span;
    }
    return force;
  }

  //! Gravity and the constant force alone [N].
  const Vector3& load() const { return load_; }
  bool has_springs() const { return !springs_.empty(); }

  //! Whether a turn about the frame's origin changes it.
  bool turns() const {
    const auto off_origin = [](const End& end) { return !end.point.isZero(0.0); };
    return !center_.isZero(0.0) || std::any_of(springs_.begin(), springs_.end(), off_origin);
  }

 private:
  struct End {       // of a spring, at the body
    Vector3 point;   // in the body's frame
    Vector3 anchor;  // the other end, in the world
    double stiffness, rest_length;
  };

  Vector3 load_, center_;
  std::vector<End> springs_;
};

//! How an object can turn.
enum class Turning {
  none,        ///< not at all, or it makes no difference: a ball
  about_axis,  ///< about one axis of the world
  all,         ///< freely
};

//! Where a pose lies.
enum class Side {
  captured,  ///< in the capture set: an escape ends where it leaves that
  outside,   ///< outside of it, settled as low as it gets there
  any,
};

//! One object of a problem, by poses of its centre of mass: without springs its energy is linear on a way.
class Landscape {
 public:
  //! `object` is the index of a body that moves freely.
  Landscape(const Problem& problem, std::size_t object)
      : body_(problem.scene.bodies()[object]),
        center_(problem.scene.inertial(object).center),
        free_space_(problem.scene, problem.state, object),
        potential_(problem.scene, problem.state, object),
        captured_(problem.captured, problem.scene),
        turning_(turning_of(body_, potential_)),
        axis_(body_.angular_factor),
        size_(problem.scene.smallest_half_extent(object)),
        radius_(reach_from(body_.shape, center_)),
        spacing_(spacing_share * radius_),
        least_step_(least_step_share * size_),
        offset_(StateLayout(problem.scene).offset(object)),
        state_(at_rest(problem)) {
    if (problem.within) within_.emplace(*problem.within, problem.scene);
    const BodyState start = StateLayout::read(state_.data() + offset_);
    start_ = {start.position + start.orientation * center_, start.orientation};
    start_energy_ = potential_(frame(start_));
    for (int axis = 0; axis < 3; ++axis) {
      Pose pose = start_;
      pose.position[axis] += free_space_.tolerance() * body_.linear_factor[axis];
      negligible_ = std::max(negligible_, std::abs(potential_(frame(pose)) - start_energy_));
    }
  }

  const Pose& start() const { return start_; }
  const Vector3& sliding() const { return body_.linear_factor; }  //!< 1: free along the axis, 0: locked
  Turning turning() const { return turning_; }
  const Vector3& axis() const { return axis_; }  //!< for Turning::about_axis
  const Potential& potential() const { return potential_; }
  double size() const { return size_; }      //!< the object's smallest half extent [m]
  double radius() const { return radius_; }  //!< of its farthest point from its centre of mass [m]

  //! Potential energy above that at the start, and at least 0 [J].
  double energy(const Pose& pose) const { return std::max(0.0, potential_(frame(pose)) - start_energy_); }

  //! The energy of a move as short as the depth that counts as touching [J].
  double negligible() const { return negligible_; }

  //! Whether the object overlaps nothing, and is within Z_b.
  bool allowed(const Pose& pose) { return free_space_.clearance(frame(pose), 0.0) >= 0.0 && within(pose); }

  //! Whether the object is outside of the capture set, at rest.
  bool outside(const Pose& pose) { return !captured_(state(pose)); }

  //! How far the object moves: no point of it moves farther on the way [m].
  double length(const Pose& from, const Pose& to) const {
    const double distance = (to.position - from.position).norm();
    return turning_ == Turning::none ? distance : distance + radius_ * angle(from.orientation, to.orientation);
  }

  //! The same path with poses at most `spacing` [m] apart; by default a tenth of the radius.
  Path divide(const Path& path, std::optional<double> spacing = std::nullopt) const {
    Path fine{path.front()};
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const int count = pieces_of(length(path[i], path[i + 1]), spacing.value_or(spacing_));
      for (int j = 1; j < count; ++j) fine.push_back(interpolate(path[i], path[i + 1], static_cast<double>(j) / count));
      fine.push_back(path[i + 1]);
    }
    return fine;
  }

  //! The highest energy on a way. With springs, what is high for less than a tenth of the radius may be missed.
  struct Peak {
    double energy = 0.0;  //!< [J]
    double at = 0.0;      //!< share of the way, 0..1
  };

  Peak peak(const Pose& from, const Pose& to) const {
    Peak highest{energy(from), 0.0};
    const auto look = [&](double at) {
      const double here = energy(at == 1.0 ? to : interpolate(from, to, at));
      if (here > highest.energy) highest = {here, at};
    };
    look(1.0);
    if (!potential_.has_springs()) return highest;  // it is linear
    const int count = pieces_of(length(from, to), spacing_);
    for (int i = 1; i < count; ++i) look(static_cast<double>(i) / count);
    // Closer and closer around the highest.
    for (double step = 0.5 / count; step > finest_share / count; step *= 0.5) {
      const double middle = highest.at;
      if (middle - step > 0.0) look(middle - step);
      if (middle + step < 1.0) look(middle + step);
    }
    return highest;
  }

  //! Where the energy of a path is highest: between path[edge] and path[edge + 1].
  struct Barrier : Peak {
    std::size_t edge = 0;
  };

  Barrier barrier(const Path& path) const {
    Barrier highest;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Peak here = peak(path[i], path[i + 1]);
      if (here.energy > highest.energy) highest = {here, i};
    }
    return highest;
  }

  //! Whether a way is allowed up to its end; its start is. Between two poses that are checked no point moves farther
  //! than a hundredth of the object's smallest half extent, unless the clearance there is larger.
  bool passes(const Pose& from, const Pose& to) {
    // The middle first: what is in the way is found early. The clearance there clears a stretch on both sides.
    if (!allowed(to)) return false;
    const double whole = length(from, to);
    if (within_) {
      const int count = pieces_of(whole, spacing_);
      for (int i = 1; i < count; ++i) {
        if (!within(interpolate(from, to, static_cast<double>(i) / count))) return false;
      }
    }
    stretches_.assign(1, {0.0, 1.0});
    for (std::size_t next = 0; next < stretches_.size(); ++next) {
      const auto [first, last] = stretches_[next];
      const double middle = 0.5 * (first + last);
      const double half = 0.5 * (last - first) * whole;
      const double clear = free_space_.clearance(frame(interpolate(from, to, middle)), half);
      if (clear < 0.0) return false;
      if (clear >= half || half <= least_step_) continue;
      stretches_.emplace_back(first, middle - clear / whole);
      stretches_.emplace_back(middle + clear / whole, last);
    }
    return true;
  }

  //! Slides down the slope of the energy until something is in the way, at most by `reach` [m] along any axis of the
  //! world from the start; with `outside`, without entering the capture set.
  Pose settle(Pose pose, double reach, bool outside) {
    // Half of what counts as touching stays, so that it can slide on along what it rests on.
    const double rest = 0.5 * free_space_.tolerance();
    double longest = reach;
    for (int i = 0; i < most_slides && longest > rest; ++i) {
      const Vector3 pull = potential_.force(frame(pose)).cwiseProduct(body_.linear_factor);
      if (pull.isZero(0.0)) break;
      const double step = std::min(longest, free_space_.clearance(frame(pose), reach) - rest);
      if (step < rest) break;
      Pose next = pose;
      next.position += step * pull.normalized();
      const bool in_reach = ((next.position - start_.position).array().abs() <= reach).all();
      const bool better = potential_(frame(next)) < potential_(frame(pose)) && in_reach && within(next) &&
                          (!outside || this->outside(next));
      if (better) {
        pose = next;
      } else {
        longest = 0.5 * step;
      }
    }
    return pose;
  }

  //! The full state with the object at a pose, all at rest. The next call overwrites it.
  const State& state(const Pose& pose) {
    double* numbers = state_.data() + offset_;
    const Pose at = frame(pose);
    std::copy_n(at.position.data(), 3, numbers);
    std::copy_n(at.orientation.coeffs().data(), 4, numbers + 3);
    return state_;
  }

 private:
  static constexpr double spacing_share = 0.1;      // of the radius: between poses at which energies are looked at
  static constexpr double least_step_share = 0.01;  // of the smallest half extent: between poses in contact
  static constexpr double finest_share = 1e-3;      // of the spacing: where a highest energy is
  static constexpr int most_slides = 40;            // steps down a slope

  // Everything at rest: the capture set of a quasi-static object knows no velocities.
  static State at_rest(const Problem& problem) {
    const Scene& scene = problem.scene;
    const StateLayout layout(scene);
    State state = problem.state;
    for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
      if (layout.offset(i) >= 0) state.segment<6>(layout.offset(i) + StateLayout::velocities_of_body).setZero();
    }
    for (std::size_t i = 0; i < scene.joints().size(); ++i) {
      if (layout.joint_offset(i) >= 0) state[layout.joint_offset(i) + 1] = 0.0;
    }
    return state;
  }

  // Two free axes of the world leave none locked: turns about them add up to turns about the third.
  static Turning turning_of(const Body& body, const Potential& potential) {
    if (std::holds_alternative<Sphere>(body.shape) && !potential.turns()) return Turning::none;
    const double free = body.angular_factor.sum();
    if (free == 0.0) return Turning::none;
    return free == 1.0 ? Turning::about_axis : Turning::all;
  }

  // So many pieces of a way are no longer than `spacing`.
  static int pieces_of(double length, double spacing) {
    return std::max(1, static_cast<int>(std::ceil(length / spacing)));
  }

  Pose frame(const Pose& pose) const { return {pose.position - pose.orientation * center_, pose.orientation}; }

  bool within(const Pose& pose) { return !within_ || (*within_)(state(pose)); }

  Body body_;
  Vector3 center_;  // of mass, in the body's frame
  Pose start_;
  FreeSpace free_space_;
  Potential potential_;
  Membership captured_;
  std::optional<Membership> within_;
  Turning turning_ = Turning::none;
  Vector3 axis_ = Vector3::UnitZ();
  double size_, radius_, spacing_, least_step_;
  double start_energy_ = 0.0;
  double negligible_ = 0.0;
  int offset_;
  State state_;
  std::vector<std::pair<double, double>> stretches_;  // of a way, as shares of it, still to be checked
};

}  // namespace energymargin::quasistatic

#pragma once
// Scenes with joints, and what is measured on them.

#include <cmath>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "energymargin/world.hpp"
#include "scenes.hpp"

namespace energymargin::scenes {

//! A joint whose frames are not turned, at `in_parent` and `in_child`.
inline Joint joint(const std::string& name, JointType type, const std::string& parent, const std::string& child,
                   const Vector3& axis, const Vector3& in_parent = Vector3::Zero(),
                   const Vector3& in_child = Vector3::Zero()) {
  Joint made;
  made.name = name;
  made.type = type;
  made.parent = parent;
  made.child = child;
  made.axis = axis;
  made.in_parent.position = in_parent;
  made.in_child.position = in_child;
  return made;
}

inline std::vector<int> each_step(int steps) {
  std::vector<int> record(static_cast<std::size_t>(steps) + 1);
  std::iota(record.begin(), record.end(), 0);
  return record;
}

//! The states at the start and after each step.
inline std::vector<State> trajectory(const Scene& scene, const State& start, int steps, const Plan& script = {}) {
  std::vector<State> states;
  for (Frame& frame : World(scene).simulate(start, script, steps, each_step(steps))) {
    states.push_back(std::move(frame.state));
  }
  return states;
}

inline State after(const Scene& scene, const State& start, int steps, const Plan& script = {}) {
  return World(scene).simulate(start, script, steps, {steps}).front().state;
}

inline BodyState body_in(const Scene& scene, const State& state, const std::string& name) {
  return unpack(scene, state).bodies.at(name);
}

inline JointState joint_in(const Scene& scene, const State& state, const std::string& name) {
  return unpack(scene, state).joints.at(name);
}

//! The same wrench in each of `steps` steps.
inline Drive steady(const std::string& body, const Vector3& force, const Vector3& torque, int steps) {
  Drive drive{body, Wrenches::Zero(steps, 6)};
  drive.wrenches.leftCols<3>().rowwise() = force.transpose();
  drive.wrenches.rightCols<3>().rowwise() = torque.transpose();
  return drive;
}

//! A body's centre of mass, and how it moves.
inline BodyState center_of(const Body& body, const BodyState& frame) {
  return state_at_point(body.principal_inertial().center, frame);
}

//! Moments of inertia about the centre of mass, in the world's axes.
inline Eigen::Matrix3d inertia_of(const Body& body, const Quaternion& orientation) {
  const Inertial inertial = body.principal_inertial();
  const Eigen::Matrix3d axes = (orientation * inertial.axes).toRotationMatrix();
  return axes * inertial.moments.asDiagonal() * axes.transpose();
}

//! Of all bodies that move.
inline Vector3 momentum(const Scene& scene, const State& state) {
  Vector3 sum = Vector3::Zero();
  for (const auto& [name, at] : unpack(scene, state).bodies) {
    const Body& body = scene.body(name);
    sum += body.mass * center_of(body, at).velocity;
  }
  return sum;
}

//! Of all bodies that move, about the world's origin.
inline Vector3 angular_momentum(const Scene& scene, const State& state) {
  Vector3 sum = Vector3::Zero();
  for (const auto& [name, at] : unpack(scene, state).bodies) {
    const Body& body = scene.body(name);
    const BodyState center = center_of(body, at);
    sum += center.position.cross(body.mass * center.velocity) + inertia_of(body, at.orientation) * at.angular_velocity;
  }
  return sum;
}

//! A pose seen from another one.
inline Pose seen_from(const Pose& frame, const Pose& pose) {
  const Quaternion back = frame.orientation.conjugate();
  return {back * (pose.position - frame.position), back * pose.orientation};
}

//! The same body in other words: its frame is at `frame` of what it was, and its mass is where it was.
inline Body described_from(const Pose& frame, const Body& body) {
  Body same = body;
  std::visit(
      [&](const auto& shape) {
        using Kind = std::decay_t<decltype(shape)>;
        if constexpr (std::is_constructible_v<Solid, Kind>) same.shape = Compound{{{shape, seen_from(frame, Pose{})}}};
      },
      body.shape);
  if (const auto* compound = std::get_if<Compound>(&body.shape)) {
    Compound moved = *compound;
    for (Part& part : moved.parts) part.pose = seen_from(frame, part.pose);
    same.shape = moved;
  }
  const Inertial inertial = body.principal_inertial();
  const Pose center = seen_from(frame, {inertial.center, inertial.axes});
  if (!body.fixed()) same.inertial = Inertial{center.position, inertial.moments, center.orientation};
  same.state = state_at_point(frame.position, body.state);
  same.state.orientation = body.state.orientation * frame.orientation;
  return same;
}

//! A rod along x that turns about its end on a fixed post at the origin; 0.5 m long, 0.3 kg.
inline Scene rod_on_post(const Vector3& axis, const Vector3& gravity = Vector3::Zero(), Joint drive = {}) {
  Scene scene(gravity, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("rod", Box{{0.5, 0.04, 0.04}}, 0.3, Vector3::Zero()));
  Joint hinge = joint("hinge", JointType::revolute, "post", "rod", axis, Vector3::Zero(), {-0.25, 0.0, 0.0});
  drive.name = hinge.name;
  drive.type = hinge.type;
  drive.parent = hinge.parent;
  drive.child = hinge.child;
  drive.axis = hinge.axis;
  drive.in_parent = hinge.in_parent;
  drive.in_child = hinge.in_child;
  scene.add_joint(drive);
  return scene;
}

//! Of that rod about the post, for an axis across it [kg m^2].
constexpr double rod_inertia = 0.3 * (0.5 * 0.5 + 0.04 * 0.04) / 12.0 + 0.3 * 0.25 * 0.25;

//! Two free boxes that a hinge connects, off the centres of both; the object is far away.
inline Scene two_boxes_on_a_hinge(const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity, exact());
  scene.add_body(body("base", Box{{0.3, 0.2, 0.1}}, 1.2, {0.1, 0.2, 0.3}));
  scene.add_body(body("arm", Box{{0.1, 0.1, 0.4}}, 0.7, Vector3::Zero()));
  Joint hinge = joint("hinge", JointType::revolute, "base", "arm", Vector3(1.0, 2.0, 2.0) / 3.0, {0.15, 0.05, 0.02},
                      {0.02, -0.05, -0.2});
  hinge.in_parent.orientation = turn(0.4, Vector3::UnitX());
  hinge.in_child.orientation = turn(-0.7, Vector3::UnitY());
  scene.add_joint(hinge);
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  return scene;
}

//! A hand: three compliant fingers of three or four joints on a fixed palm, closed on a box of 6 cm and 0.1 kg with
//! 2 N from each side. The box stands on a table or, lifted, is held by the fingers alone.
inline Scene hand(double friction = 1.0, bool lifted = false, const Stepping& stepping = {}) {
  constexpr double radius = 0.01;
  constexpr double half = 0.03;
  const std::vector<double> lengths{0.09, 0.07, 0.05};
  const std::vector<double> bends{0.5, -0.7, -0.2};
  const Vector3 palm(0.0, 0.0, 0.25);
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("table", Plane{Vector3::UnitZ(), lifted ? -1.0 : 0.0}, Vector3::Zero(), 1.0));
  Body plate = fixed("palm", Box{{0.14, 0.14, 0.01}}, palm);
  plate.role = Role::effector;
  scene.add_body(plate);
  scene.add_body(body("object", Box{{0.06, 0.06, 0.06}}, 0.1, {0.0, 0.0, half}, Role::object, 1.0));

  // A link on the one before it, or on the palm.
  const auto add = [&](const std::string& link, const Shape& shape, double mass, Joint made) {
    scene.add_body(body(link, shape, mass, Vector3::Zero(), Role::effector, friction));
    made.damping = 0.03;
    scene.add_joint(made);
  };
  const auto finger = [&](const std::string& name, const Vector3& outward, double aside, double force, bool knuckle) {
    std::vector<double> above(lengths.size());  // height of each joint above the tip
    double out = half + radius;                 // of the first joint from the axis of the hand
    double angle = std::accumulate(bends.begin(), bends.end(), 0.0);
    double height = 0.0;
    for (std::size_t i = lengths.size(); i-- > 0;) {
      height += lengths[i] * std::cos(angle);
      out -= lengths[i] * std::sin(angle);
      angle -= bends[i];
      above[i] = height;
    }
    const Vector3 side = Vector3::UnitZ().cross(outward);
    std::string parent = "palm";
    Vector3 place = outward * out + side * aside + Vector3(0.0, 0.0, half + above[0]) - palm;
    if (knuckle) {
      const Vector3 top(0.0, 0.0, 0.02);
      Joint inertial = joint(name + " 0", JointType::revolute, parent, name + " 0", outward, place + top, top);
      inertial.stiffness = 5.0;
      add(name + " 0", Sphere{radius}, 0.02, inertial);
      parent = name + " 0";
      place.setZero();
    }
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const std::string link = name + " " + std::to_string(i + 1);
      const Vector3 end(0.0, 0.0, 0.5 * lengths[i]);
      Joint bend = joint(link, JointType::revolute, parent, link, -side, place, end);
      bend.state.position = bends[i];
      bend.stiffness = 1.0;
      bend.target = bends[i] - force * above[i] / bend.stiffness;
      bend.lower = bends[i] - 0.8;
      bend.upper = bends[i] + 0.8;
      add(link, Capsule{radius, lengths[i] - (i == 2 ? 0.0 : 2.0 * radius)}, 0.03, bend);
      parent = link;
      place = -end;
    }
  };
  finger("left", Vector3::UnitX(), 0.015, 1.0, false);
  finger("right", Vector3::UnitX(), -0.015, 1.0, false);
  finger("thumb", -Vector3::UnitX(), 0.0, 2.0, true);
  return scene;
}

}  // namespace energymargin::scenes

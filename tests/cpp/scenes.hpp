#pragma once
// The few scenes that the tests share.

#include <limits>
#include <string>
#include <vector>

#include "base/check.hpp"
#include "energymargin/problem.hpp"
#include "physics/native/friction_law.hpp"

namespace energymargin::scenes {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double g = 9.81;
inline const Vector3 downwards(0.0, 0.0, -g);

//! How far contacts give along their normal, contacts that stick, and stops: the share of what a load would do along
//! them in a step, if their body is a point.
constexpr double giving = FrictionLaw::normal_share;
constexpr double creeping = FrictionLaw::tangential_share;
constexpr double stop_giving = 1e-5;

//! Solver settings that leave next to no residual, for laws that hold to the last digits.
inline Stepping exact() {
  Stepping stepping;
  stepping.tolerance = 1e-12;
  return stepping;
}

inline Quaternion turn(double angle, const Vector3& axis) { return Quaternion(Eigen::AngleAxisd(angle, axis)); }

inline Body body(const std::string& name, const Shape& shape, double mass, const Vector3& position,
                 Role role = Role::none, double friction = 0.5) {
  Body made;
  made.name = name;
  made.shape = shape;
  made.mass = mass;
  made.state.position = position;
  made.role = role;
  made.friction = friction;
  return made;
}

inline Body fixed(const std::string& name, const Shape& shape, const Vector3& position = Vector3::Zero(),
                  double friction = 0.5) {
  return body(name, shape, 0.0, position, Role::none, friction);
}

//! The corners of a brick.
inline ConvexHull brick(const Vector3& size, const Quaternion& turned = Quaternion::Identity(),
                        const Vector3& moved = Vector3::Zero()) {
  ConvexHull hull;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    hull.points.push_back(turned * side.cwiseProduct(size) + moved);
  }
  return hull;
}

//! A body alone, far from everything.
inline Scene free_body(const Shape& shape = Box{{1.0, 0.4, 0.2}}, double mass = 2.0,
                       const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity);
  scene.add_body(body("object", shape, mass, Vector3::Zero(), Role::object));
  return scene;
}

//! A block on a table; the coefficient of their contact is 1.0 * 0.5.
inline Scene rough_table(const Stepping& stepping = exact(), const Shape& shape = Box{{1.2, 0.4, 0.1}},
                         double height = 0.05) {
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("table", Plane{}, Vector3::Zero(), 1.0));
  scene.add_body(body("object", shape, 1.0, {0.0, 0.0, height}, Role::object, 0.5));
  return scene;
}

//! A scene's own state, the largest force [N] and torque [N m] along each axis, the longest edge [s], the capture set.
inline Problem problem_of(const Scene& scene, const Vector3& force, const Vector3& torque, double duration,
                          const Region& captured) {
  Problem problem(scene, pack(scene), captured);
  problem.force = force;
  problem.torque = torque;
  problem.duration = duration;
  return problem;
}

//! A pusher that moves towards a bar on a table.
inline Scene push_scene() {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", Box{{1.2, 0.4, 0.1}}, 1.0, {1.0, 0.4, 0.05}, Role::object, 0.3));
  Body effector = body("effector", Cylinder{0.1, 0.1}, 4.0, {1.0, 0.1, 0.05}, Role::effector, 0.3);
  effector.state.velocity = {0.0, 0.4, 0.0};
  scene.add_body(effector);
  return scene;
}

inline Problem push(Effector effector = Effector::drive) {
  const Scene scene = push_scene();
  Problem problem =
      problem_of(scene, {0.8, 0.8, 0.0}, {0.0, 0.0, 0.05}, 0.5, regions::Disc{"object", {1.0, 0.4}, 0.15});
  problem.succeeded = regions::HalfSpace{"object", {0.0, -1.0, 0.0}, -0.5};
  problem.effector = effector;
  return problem;
}

//! An object between four fixed walls that is far from leaving the capture set.
inline Problem closed_cage() {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  scene.add_body(fixed("east", Box{{0.4, 1.4, 0.6}}, {0.4, 0.0, 0.3}));
  scene.add_body(fixed("west", Box{{0.4, 1.4, 0.6}}, {-0.4, 0.0, 0.3}));
  scene.add_body(fixed("north", Box{{1.4, 0.4, 0.6}}, {0.0, 0.4, 0.3}));
  scene.add_body(fixed("south", Box{{1.4, 0.4, 0.6}}, {0.0, -0.4, 0.3}));
  scene.add_body(body("object", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, 0.1}, Role::object, 0.2));
  return problem_of(scene, {3.0, 3.0, 0.0}, Vector3::Zero(), 0.3, regions::Disc{"object", {0.0, 0.0}, 0.2});
}

//! A block that rails let move up and down only, on a floor; to escape it must be lifted by `height`.
inline Problem lift(double height) {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  Body block = body("object", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, 0.1}, Role::object);
  block.linear_factor = Vector3::UnitZ();
  block.angular_factor = Vector3::Zero();
  scene.add_body(block);
  return problem_of(scene, {0.0, 0.0, 20.0}, Vector3::Zero(), 0.3,
                    regions::HalfSpace{"object", Vector3::UnitZ(), 0.1 + height});
}

//! A body without gravity that any disturbance moves; it escapes through the rim of a disc.
inline Problem drift() {
  const Scene scene = free_body();
  return problem_of(scene, {1.0, 1.0, 0.0}, {0.0, 0.0, 0.1}, 0.5, regions::Disc{"object", {0.0, 0.0}, 0.2});
}

}  // namespace energymargin::scenes

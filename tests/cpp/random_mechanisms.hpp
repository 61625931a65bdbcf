#pragma once
// Random scenes of several mechanisms, and rollouts in which their bodies are fast.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "mechanisms.hpp"
#include "rollouts.hpp"

namespace energymargin::scenes {

//! Adds mechanisms to a scene, with random links and joints.
class RandomMechanisms {
 public:
  explicit RandomMechanisms(std::uint64_t seed) : random_(seed), scene_(Vector3(0.0, 0.0, -g)) {
    scene_.add_body(fixed("ground", Plane{}));
  }

  const Scene& scene() const { return scene_; }
  bool happens(double likelihood) { return even(0.0, 1.0) < likelihood; }

  //! A chain of `links` that hang from the body `parent`, at `place` in its frame, and bend about `axis` first. Returns
  //! the name of its last link.
  std::string add_chain(const std::string& name, std::string parent, Vector3 place, const Vector3& axis, int links) {
    for (int i = 1; i <= links; ++i) {
      const std::string link = name + " " + std::to_string(i);
      const double length = even(0.07, 0.09);
      const Vector3 top(0.0, 0.0, 0.5 * length);
      scene_.add_body(body(link, solid(0.02, length), even(0.02, 0.08), Vector3::Zero(), Role::effector, 0.9));
      scene_.add_joint(random_joint(link, parent, i == 1 ? axis : sideways(), place, top));
      parent = link;
      place = -top;
    }
    return parent;
  }

  //! Three fingers of two links around what stands on the ground at `center`: a tree each on a fixed palm, and one tree
  //! in all on a free one.
  void add_hand(const Vector3& center, bool free) {
    const Box plate{{0.12, 0.12, 0.02}};
    const Vector3 place = center + Vector3(0.0, 0.0, 0.2);
    scene_.add_body(free ? body("palm", plate, 0.5, place, Role::effector) : fixed("palm", plate, place));
    for (int i = 0; i < 3; ++i) {
      const Vector3 outward = turn(2.0 * pi * i / 3.0 + even(-0.2, 0.2), Vector3::UnitZ()) * Vector3::UnitX();
      add_chain("finger " + std::to_string(i), "palm", 0.065 * outward + Vector3(0.0, 0.0, -0.01),
                Vector3::UnitZ().cross(outward), 2);
    }
  }

  //! Two arms on a fixed table, each a tree.
  void add_arms(const Vector3& center) {
    scene_.add_body(fixed("table", Box{{0.4, 0.3, 0.02}}, center + Vector3(0.0, 0.0, 0.42)));
    for (const double side : {-0.06, 0.06}) {
      add_chain(side < 0.0 ? "left arm" : "right arm", "table", {side, 0.0, -0.01}, Vector3::UnitY(), 3);
    }
  }

  //! A free base with two limbs.
  void add_walker(const Vector3& center) {
    scene_.add_body(body("trunk", solid(0.08, 0.1), 0.4, center + Vector3(0.0, 0.0, 0.25)));
    add_chain("fore limb", "trunk", {0.05, 0.0, -0.04}, Vector3::UnitY(), 2);
    add_chain("hind limb", "trunk", {-0.05, 0.0, -0.04}, Vector3::UnitX(), 1);
  }

  //! A link on `parent` whose joint follows the joint `followed`, which may be on another tree.
  void add_follower(const std::string& name, const std::string& parent, const std::string& followed) {
    scene_.add_body(body(name, solid(0.02, 0.06), 0.02, Vector3::Zero()));
    Joint follower = joint(name, JointType::revolute, parent, name, sideways(), {0.0, 0.0, -0.01}, {0.0, 0.0, 0.03});
    follower.mimic = Mimic{followed, happens(0.5) ? -0.7 : 1.3, 0.1};
    scene_.add_joint(follower);
  }

  void tie(const std::string& body_a, const std::string& body_b) {
    Spring spring;
    spring.body_a = body_a;
    spring.body_b = body_b;
    spring.point_a = {0.0, 0.005, 0.0};
    spring.stiffness = even(2.0, 8.0);
    spring.rest_length = 0.1;
    spring.damping = 0.02;
    scene_.add_spring(spring);
  }

  void add_object(const std::string& name, const Vector3& place) {
    Body made = body(name, solid(0.05, 0.06), even(0.05, 0.15), place, Role::object, 0.8);
    made.state.orientation = turn(even(0.0, pi), Vector3::UnitZ());
    scene_.add_body(made);
  }

  //! A fixed plate across x.
  void add_wall(const std::string& name, const Vector3& place) {
    scene_.add_body(fixed(name, Box{{even(0.001, 0.004), 0.4, 0.4}}, place));
  }

 private:
  double even(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vector3 sideways() { return happens(0.5) ? Vector3::UnitX() : Vector3::UnitY(); }

  //! A solid `width` across and `length` along z.
  Shape solid(double width, double length) {
    const Vector3 size(width, width, length);
    const Vector3 half(width, width, 0.5 * length);
    const Vector3 foot(1.5 * width, width, 0.5 * length);
    const Pose up{{0.0, 0.0, 0.25 * length}, Quaternion::Identity()};
    const Pose down{{0.0, 0.0, -0.25 * length}, Quaternion::Identity()};
    switch (std::uniform_int_distribution<int>(0, 6)(random_)) {
      case 0:
        return Capsule{0.5 * width, length - width};
      case 1:
        return Cylinder{0.5 * width, length};
      case 2:
        return brick(size, turn(0.3, Vector3::UnitZ()));
      case 3:
        return Compound{{{Box{half}, up}, {Sphere{std::min(0.5 * width, 0.25 * length)}, down}}};
      case 4:
        return Compound{{{brick(half), up}, {Box{foot}, down}}};
      default:
        return Box{size};
    }
  }

  Joint random_joint(const std::string& name, const std::string& parent, const Vector3& axis, const Vector3& in_parent,
                     const Vector3& in_child) {
    Joint made = joint(name, JointType::revolute, parent, name, axis, in_parent, in_child);
    if (happens(0.1)) {
      made.type = JointType::fixed;
      return made;
    }
    if (happens(0.15)) {
      made.type = JointType::prismatic;
      made.axis = Vector3::UnitZ();
    }
    const double range = made.type == JointType::revolute ? 0.9 : 0.03;
    made.state.position = even(-0.05, 0.05) * range;
    made.held = happens(0.15);
    made.stiffness = made.type == JointType::revolute ? even(0.1, 1.0) : even(50.0, 200.0);
    made.damping = 0.02 * made.stiffness;
    made.target = even(-0.5, 0.5) * range;
    if (happens(0.2)) made.torque_limit = 0.5 * made.stiffness * range;
    if (happens(0.6)) {
      made.lower = -range;
      made.upper = range;
    }
    return made;
  }

  std::mt19937_64 random_;
  Scene scene_;
};

//! A hand with an object between its fingers and, beside it, arms on a table or a walker, each a tree or more; a second
//! object, thin walls and a ball that is far away. Springs and mimic joints connect some of the trees.
inline Scene random_mechanisms(std::uint64_t seed) {
  RandomMechanisms made(seed);
  made.add_hand(Vector3::Zero(), made.happens(0.3));
  const bool arms = made.happens(0.5);
  const Vector3 beside(0.25, 0.0, 0.0);
  if (arms) {
    made.add_arms(beside);
  } else {
    made.add_walker(beside);
  }
  const std::string other = arms ? "left arm 1" : "fore limb 1";
  const Joint& leader = made.scene().joints()[made.scene().joint_index(other)];
  if (leader.moves() && made.happens(0.6)) made.add_follower("thumb", "palm", other);
  if (made.happens(0.6)) made.tie("finger 1 2", other);
  if (arms && made.happens(0.5)) made.tie("left arm 3", "right arm 3");
  made.add_object("object", {0.0, 0.0, 0.031});
  if (made.happens(0.7)) made.add_object("second object", {0.25, 0.12, 0.031});
  made.add_wall("near wall", {0.12, 0.0, 0.2});
  if (made.happens(0.5)) made.add_wall("far wall", {0.4, 0.0, 0.2});
  Scene scene = made.scene();
  scene.add_body(body("ball", Sphere{0.05}, 0.2, {20.0, 0.0, 0.05}));
  return scene;
}

//! `state` with other velocities: free bodies have at most `speed` [m/s] and `spin` [rad/s] along each axis, joints a
//! part of these.
inline State hurled(const Scene& scene, State state, std::mt19937_64& random, double speed = 10.0,
                    double spin = 100.0) {
  const auto even = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  const StateLayout layout(scene);
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) < 0) continue;
    const int first = layout.offset(i) + StateLayout::velocities_of_body;
    for (int axis = 0; axis < 3; ++axis) {
      state[first + axis] = even(speed);
      state[first + 3 + axis] = even(spin);
    }
  }
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    if (layout.joint_offset(i) < 0 || scene.joints()[i].held) continue;
    const bool turns = scene.joints()[i].type == JointType::revolute;
    state[layout.joint_offset(i) + 1] = even(turns ? 0.3 * spin : 0.1 * speed);
  }
  return state;
}

//! Those of `questions`, with every other one from a state in which all is fast.
inline std::vector<Question> hurled_questions(const Scene& scene, int count, unsigned int longest) {
  std::vector<Question> asked = questions(scene, count, longest);
  std::mt19937_64 random(11);
  for (std::size_t i = 1; i < asked.size(); i += 2) asked[i].state = hurled(scene, asked[i].state, random);
  return asked;
}

}  // namespace energymargin::scenes

// Forward kinematics against poses worked out by hand, and against Bullet.

#include "energymargin/kinematics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Transform = Eigen::Isometry3d;

Transform transform(const Vector3& position, const Quaternion& orientation) {
  return Eigen::Translation3d(position) * orientation;
}

Transform transform(const BodyState& at) { return transform(at.position, at.orientation); }
Transform transform(const Pose& pose) { return transform(pose.position, pose.orientation); }

// A hull that leans in its frame: its principal axes are not the frame's.
Shape leaning_brick() { return brick({0.3, 0.1, 0.06}, turn(0.6, Vector3(1.0, 2.0, -1.0).normalized())); }

// A tree on a free base, with a joint of every type and oblique frames on both sides.
Scene oblique_tree(const Stepping& stepping = exact()) {
  Scene scene(Vector3::Zero(), stepping);
  scene.add_body(body("base", leaning_brick(), 1.5, {0.3, -0.2, 0.4}));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto vector = [&](double scale) { return Vector3(scale * Vector3(even(random), even(random), even(random))); };
  const auto add = [&](const std::string& child, const std::string& parent, JointType type, const Shape& shape) {
    scene.add_body(body(child, shape, 0.8, Vector3::Zero()));
    Joint made = joint("to " + child, type, parent, child, vector(1.0).normalized(), vector(0.6), vector(0.6));
    made.in_parent.orientation = turn(2.0 * even(random), vector(1.0).normalized());
    made.in_child.orientation = turn(2.0 * even(random), vector(1.0).normalized());
    scene.add_joint(made);
  };
  add("one", "base", JointType::revolute, Box{{0.2, 0.1, 0.05}});
  add("two", "one", JointType::prismatic, leaning_brick());
  add("three", "two", JointType::fixed, leaning_brick());
  add("four", "three", JointType::revolute, leaning_brick());
  add("other", "base", JointType::revolute, Capsule{0.03, 0.2});
  scene.add_body(body("probe", Sphere{0.05}, 1.0, {3.0, 1.0, 2.0}, Role::object));
  return scene;
}

State oblique_state(const Scene& scene) {
  return pack(
      scene,
      {{"base",
        {{1.0, 2.0, 3.0}, turn(1.1, Vector3(2.0, -1.0, 1.0).normalized()), {0.5, -0.4, 0.3}, {0.6, 0.9, -1.2}}}},
      {{"to one", {0.7, 1.5}}, {"to two", {-0.4, 0.8}}, {"to four", {2.1, -2.0}}, {"to other", {-1.0, 0.6}}});
}

TEST(Kinematics, RevoluteChainIsWhereItsAnglesPutIt) {
  Scene scene;
  scene.add_body(fixed("post", Box{}, {1.0, 2.0, 3.0}));
  scene.add_body(body("upper", Box{{0.6, 0.1, 0.1}}, 1.0, Vector3::Zero()));
  scene.add_body(body("lower", Box{{0.4, 0.1, 0.1}}, 1.0, Vector3::Zero()));
  scene.add_joint(
      joint("shoulder", JointType::revolute, "post", "upper", Vector3::UnitZ(), {0.0, 0.0, 0.5}, {-0.3, 0.0, 0.0}));
  scene.add_joint(
      joint("elbow", JointType::revolute, "upper", "lower", Vector3::UnitZ(), {0.3, 0.0, 0.0}, {-0.2, 0.0, 0.0}));
  const double a = 0.3;
  const double b = 0.3 - 0.8;
  const State state = pack(scene, {}, {{"shoulder", {a, 2.0}}, {"elbow", {b - a, -3.0}}});
  const auto along = [](double angle) { return Vector3(std::cos(angle), std::sin(angle), 0.0); };
  const auto across = [](double angle) { return Vector3(-std::sin(angle), std::cos(angle), 0.0); };
  const BodyState upper = body_in(scene, state, "upper");
  const BodyState lower = body_in(scene, state, "lower");
  const Vector3 shoulder(1.0, 2.0, 3.5);
  EXPECT_LT((upper.position - shoulder - 0.3 * along(a)).norm(), 1e-15);
  EXPECT_LT((upper.velocity - 2.0 * 0.3 * across(a)).norm(), 1e-15);
  EXPECT_LT((upper.angular_velocity - Vector3(0.0, 0.0, 2.0)).norm(), 1e-15);
  EXPECT_LT(upper.orientation.angularDistance(turn(a, Vector3::UnitZ())), 1e-15);
  EXPECT_LT((lower.position - shoulder - 0.6 * along(a) - 0.2 * along(b)).norm(), 1e-15);
  EXPECT_LT((lower.velocity - 2.0 * 0.6 * across(a) + 0.2 * across(b)).norm(), 1e-15);
  EXPECT_LT((lower.angular_velocity - Vector3(0.0, 0.0, -1.0)).norm(), 1e-15);
  EXPECT_LT(lower.orientation.angularDistance(turn(b, Vector3::UnitZ())), 1e-15);
}

TEST(Kinematics, PrismaticChainSlidesAlongItsAxes) {
  Scene scene;
  Body post = fixed("post", Box{}, {1.0, 0.0, 0.0});
  post.state.orientation = turn(0.5 * pi, Vector3::UnitZ());  // its x axis is the world's y axis
  scene.add_body(post);
  scene.add_body(body("slide", Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero()));
  scene.add_body(body("lift", Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero()));
  scene.add_joint(joint("along", JointType::prismatic, "post", "slide", Vector3::UnitX(), {0.0, 0.0, 0.1}));
  scene.add_joint(
      joint("up", JointType::prismatic, "slide", "lift", {0.0, 0.6, 0.8}, {0.2, 0.0, 0.0}, {0.0, 0.0, -0.05}));
  const State state = pack(scene, {}, {{"along", {0.5, 2.0}}, {"up", {0.25, -1.0}}});
  const BodyState slide = body_in(scene, state, "slide");
  const BodyState lift = body_in(scene, state, "lift");
  EXPECT_LT((slide.position - Vector3(1.0, 0.5, 0.1)).norm(), 1e-15);
  EXPECT_LT((slide.velocity - Vector3(0.0, 2.0, 0.0)).norm(), 1e-15);
  EXPECT_LT((lift.position - Vector3(1.0 - 0.15, 0.7, 0.1 + 0.2 + 0.05)).norm(), 1e-15);
  EXPECT_LT((lift.velocity - Vector3(0.6, 2.0, -0.8)).norm(), 1e-15);
  EXPECT_EQ(lift.angular_velocity, Vector3::Zero());
  EXPECT_LT(lift.orientation.angularDistance(post.state.orientation), 1e-15);
}

TEST(Kinematics, ChildsJointFrameIsTheParentsMovedByTheJoint) {
  const Scene scene = oblique_tree();
  const Unpacked at = unpack(scene, oblique_state(scene));
  for (const Joint& made : scene.joints()) {
    const double position = made.moves() ? at.joints.at(made.name).position : 0.0;
    Transform motion = Transform::Identity();
    if (made.type == JointType::revolute) motion.rotate(Eigen::AngleAxisd(position, made.axis));
    if (made.type == JointType::prismatic) motion.translate(position * made.axis);
    const Transform in_parent = transform(at.bodies.at(made.parent)) * transform(made.in_parent);
    const Transform in_child = transform(at.bodies.at(made.child)) * transform(made.in_child);
    EXPECT_TRUE((in_parent * motion).isApprox(in_child, 1e-14)) << made.name;
  }
}

TEST(Kinematics, VelocitiesAreTheDerivativesOfThePoses) {
  const Scene scene = oblique_tree();
  const State state = oblique_state(scene);
  const Unpacked at = unpack(scene, state);
  constexpr double moment = 1e-5;
  const auto moved = [&](double time) {
    BodyState base = at.bodies.at("base");
    base.position += time * base.velocity;
    base.orientation = turn(time * base.angular_velocity.norm(), base.angular_velocity.normalized()) * base.orientation;
    std::map<std::string, JointState> joints = at.joints;
    for (auto& [name, now] : joints) now.position += time * now.velocity;
    return unpack(scene, pack(scene, {{"base", base}}, joints)).bodies;
  };
  const auto before = moved(-moment);
  const auto later = moved(moment);
  for (const char* name : {"one", "two", "three", "four", "other"}) {
    const BodyState& now = at.bodies.at(name);
    const Vector3 velocity = (later.at(name).position - before.at(name).position) / (2.0 * moment);
    const Eigen::AngleAxisd turned(later.at(name).orientation * before.at(name).orientation.conjugate());
    EXPECT_LT((now.velocity - velocity).norm(), 1e-8) << name;
    EXPECT_LT((now.angular_velocity - turned.angle() * turned.axis() / (2.0 * moment)).norm(), 1e-8) << name;
    EXPECT_GT(now.velocity.norm(), 0.5) << name;
  }
}

TEST(Kinematics, SceneSaysOfALinkWhereItsJointsPutItAlsoIfTheyComeInAnyOrder) {
  const Scene scene = oblique_tree();
  const Unpacked at = unpack(scene, pack(scene));
  for (const auto& [name, state] : at.bodies) {
    EXPECT_TRUE(transform(state).isApprox(transform(scene.body(name).state), 1e-15)) << name;
  }
  Scene other(Vector3::Zero(), exact());
  for (const Body& made : scene.bodies()) other.add_body(made);
  for (std::size_t i = scene.joints().size(); i-- > 0;) other.add_joint(scene.joints()[i]);
  for (const auto& [name, state] : at.bodies) {
    EXPECT_TRUE(transform(state).isApprox(transform(other.body(name).state), 1e-15)) << name;
  }
}

TEST(Kinematics, LinksCollideWhereTheyPutThem) {
  const Scene scene = oblique_tree();
  const State state = oblique_state(scene);
  World world(scene);
  const Unpacked at = unpack(scene, state);
  for (const char* name : {"base", "one", "two", "three", "four", "other"}) {
    for (const Vector3& away : {Vector3(1.0, 0.2, -0.1), Vector3(-0.3, 1.0, 0.4), Vector3(0.2, -0.5, 1.0)}) {
      BodyState probe;
      probe.position = at.bodies.at(name).position + away;
      State probing = state;
      StateLayout::write(probe, probing.data() + world.layout().offset(scene.index("probe")));
      Scene alone;
      Body copy = scene.body(name);
      copy.state = at.bodies.at(name);
      alone.add_body(copy);
      alone.add_body(body("probe", Sphere{0.05}, 1.0, probe.position));
      EXPECT_NEAR(world.distance(probing, name, "probe"), World(alone).distance(pack(alone), name, "probe"), 1e-9)
          << name;
    }
  }
}

TEST(Kinematics, LinksMoveInTheSimulationAsTheirVelocitiesSay) {
  Stepping fine = exact();
  fine.step = 1e-5;
  const Scene scene = oblique_tree(fine);
  const State start = oblique_state(scene);
  const Unpacked from = unpack(scene, start);
  const Unpacked to = unpack(scene, after(scene, start, 1));
  for (const auto& [name, now] : from.bodies) {
    const Vector3 velocity = (to.bodies.at(name).position - now.position) / fine.step;
    const Eigen::AngleAxisd turned(to.bodies.at(name).orientation * now.orientation.conjugate());
    EXPECT_LT((velocity - now.velocity).norm(), 1e-3) << name;
    EXPECT_LT((turned.angle() / fine.step * turned.axis() - now.angular_velocity).norm(), 1e-3) << name;
  }
}

}  // namespace
}  // namespace energymargin

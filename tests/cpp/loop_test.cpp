// Loops of joints and ties of free bodies: they stay closed, and pass on forces and energy.

#include <gtest/gtest.h>

#include <cmath>

#include "energymargin/audit.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double micrometre = 1e-6;

Vector3 down() { return {0.0, 0.0, -g}; }

// How far the points of a loop are apart.
double gap(const Scene& scene, const State& state) {
  const Loop& loop = scene.loops().front();
  const auto at = [&](const std::string& name, const Vector3& point) {
    const BodyState frame = scene.body(name).fixed() ? scene.body(name).state : body_in(scene, state, name);
    return Vector3(frame.position + frame.orientation * point);
  };
  return (at(loop.body_a, loop.point_a) - at(loop.body_b, loop.point_b)).norm();
}

double most_gap(const Scene& scene, const std::vector<State>& states) {
  double most = 0.0;
  for (const State& state : states) most = std::max(most, gap(scene, state));
  return most;
}

// A box on a ball joint above it, which turns about all axes.
Scene hanging_box() {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("post", Box{{0.02, 0.02, 0.02}}, {0.0, 0.0, 1.0}));
  Body box = body("object", Box{{0.1, 0.04, 0.2}}, 1.0, {0.1, 0.0, 0.8}, Role::object);
  box.state.angular_velocity = {1.0, 2.0, 3.0};
  scene.add_body(box);
  scene.add_loop({"post", "object", LoopType::point, Vector3::Zero(), {-0.1, 0.0, 0.2}});
  return scene;
}

// A crank and a rocker of 0.1 m on a frame, and the rod of 0.3 m that a loop closes: a parallelogram, about an axis.
Scene parallelogram(const Vector3& axis) {
  Scene scene(Vector3(0.0, 0.0, -g));
  const Vector3 about = Vector3::UnitY().cross(axis);  // from y to the axis
  const Quaternion turn = Quaternion(1.0 + axis.y(), about.x(), about.y(), about.z()).normalized();
  const auto placed = [&](const Vector3& at) { return Vector3(turn * at); };
  scene.add_body(fixed("frame", Box{{0.01, 0.01, 0.01}}));
  const auto add = [&](const std::string& parent, const std::string& child, const Vector3& at, const Vector3& end) {
    scene.add_body(body(child, Box{{0.02, 0.02, 0.02}}, 0.3, Vector3::Zero()));
    scene.add_joint(joint(child, JointType::revolute, parent, child, axis, placed(at), placed(-0.5 * end)));
  };
  add("frame", "crank", Vector3::Zero(), {0.0, 0.0, 0.1});
  add("crank", "rod", {0.0, 0.0, 0.05}, {0.3, 0.0, 0.0});
  add("frame", "rocker", {0.3, 0.0, 0.0}, {0.0, 0.0, 0.1});
  scene.add_loop({"rod", "rocker", LoopType::point, placed({0.15, 0.0, 0.0}), placed({0.0, 0.0, 0.05})});
  for (const char* other : {"crank", "rod", "rocker"}) scene.disable_collisions("frame", other);
  scene.disable_collisions("rod", "rocker");
  return scene;
}

TEST(Loop, BallJointStaysClosedAndKeepsEnergyAndSpin) {
  const Scene scene = hanging_box();
  World world(scene);
  const std::vector<State> states = trajectory(scene, pack(scene), 2400);
  EXPECT_LT(most_gap(scene, states), 0.1 * micrometre);
  const Vector3 pivot(0.0, 0.0, 1.0);
  const auto spin = [&](const State& state) {  // about the vertical through the joint
    const BodyState at = body_in(scene, state, "object");
    const Vector3 angular = inertia_of(scene.body("object"), at.orientation) * at.angular_velocity;
    return angular.z() + (at.position - pivot).cross(at.velocity).z();
  };
  // The box starts with the velocity of its centre at 0, which the joint does not bear: count from the first step.
  for (const State& state : states) {
    if (&state == &states.front()) continue;
    EXPECT_NEAR(world.energy(state), world.energy(states[1]), 2e-3 * std::abs(world.energy(states[1])));
    EXPECT_NEAR(spin(state), spin(states[1]), 2e-3 * std::abs(spin(states[1])));
  }
}

TEST(Loop, ParallelogramStaysOne) {
  for (const Vector3& axis : {Vector3(0.0, 1.0, 0.0), Vector3(0.6, 0.8, 0.0)}) {
    const Scene scene = parallelogram(axis);
    World world(scene);
    const State start = pack(scene, {}, {{"crank", {0.3, 0.0}}, {"rod", {-0.3, 0.0}}, {"rocker", {0.3, 0.0}}});
    const std::vector<State> states = trajectory(scene, start, 1200);
    EXPECT_LT(most_gap(scene, states), micrometre);
    double highest = 0.0;
    for (const State& state : states) {
      EXPECT_NEAR(joint_in(scene, state, "rocker").position, joint_in(scene, state, "crank").position, 1e-5);
      highest = std::max(highest, joint_in(scene, state, "crank").position);
      EXPECT_NEAR(world.energy(state), world.energy(start), 0.03);  // of 1 J that it swings with, at 22 rad/s
    }
    EXPECT_GT(highest, 3.0);  // it has swung
  }
}

// Two boxes that are welded, and fly.
TEST(Loop, WeldedBodiesFlyAsOne) {
  Scene scene(Vector3::Zero());
  for (const auto& [name, x] : {std::pair{"object", 0.0}, {"other", 0.3}}) {
    Body box = body(name, Box{{0.1, 0.04, 0.02}}, 1.0, {x, 0.0, 0.0}, x == 0.0 ? Role::object : Role::none);
    box.state.angular_velocity = {0.5, 1.0, 2.0};
    box.state.velocity = Vector3(0.5, 1.0, 2.0).cross(Vector3(x, 0.0, 0.0));
    scene.add_body(box);
  }
  scene.add_loop({"object", "other", LoopType::weld, {0.15, 0.0, 0.0}, {-0.15, 0.0, 0.0}});
  const State start = pack(scene);
  const std::vector<State> states = trajectory(scene, start, 1200);
  EXPECT_LT(most_gap(scene, states), micrometre);
  for (const State& state : states) {
    const BodyState a = body_in(scene, state, "object"), b = body_in(scene, state, "other");
    EXPECT_LT(a.orientation.angularDistance(b.orientation), 1e-6);
    EXPECT_LT((momentum(scene, state) - momentum(scene, start)).norm(), 1e-9);
  }
  EXPECT_GT(body_in(scene, states.back(), "object").position.norm(), 1.0);
}

TEST(Loop, FollowsAKinematicBody) {
  Scene scene(Vector3(0.0, 0.0, -g));
  Body hand = body("hand", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.0, 1.0}, Role::effector);
  hand.kinematic = true;
  hand.state.velocity = {0.3, 0.0, 0.0};
  hand.state.angular_velocity = {0.0, 0.0, 1.0};
  scene.add_body(hand);
  scene.add_body(body("object", Box{{0.05, 0.05, 0.05}}, 0.2, {0.0, 0.2, 1.0}, Role::object));
  scene.add_loop({"hand", "object", LoopType::weld, {0.0, 0.1, 0.0}, {0.0, -0.1, 0.0}});
  EXPECT_LT(most_gap(scene, trajectory(scene, pack(scene), 960)), micrometre);
}

TEST(Loop, ThatIsOpenAtTheStartIsPulledTogether) {
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("post", Box{{0.02, 0.02, 0.02}}));
  scene.add_body(body("object", Box{{0.1, 0.1, 0.1}}, 1.0, {0.105, 0.0, 0.0}, Role::object));
  scene.add_loop({"post", "object", LoopType::point, {0.05, 0.0, 0.0}, {-0.05, 0.0, 0.0}});
  const State end = after(scene, pack(scene), 240);
  EXPECT_LT(gap(scene, end), micrometre);
  EXPECT_LT(World(scene).energy(end), 1e-9);  // it gained no speed
}

TEST(Loop, ItsWorkIsInTheAudit) {
  const Scene scene = hanging_box();
  State start = after(scene, pack(scene), 1);
  const Audit audit = *World(scene).rollout(start, {Wrench{}}, 1.0, true).audit;
  EXPECT_NEAR(audit.leftover(), 0.0, 1e-9 * World(scene).energy(start));
}

// The box overlaps its post, and is moved out of it beside its velocities.
TEST(Loop, RecoveryFromAnOverlapGivesNoEnergy) {
  Scene scene = hanging_box();
  scene.add_body(fixed("wall", Box{{0.1, 0.1, 0.1}}, {0.1, 0.06, 0.8}));
  World world(scene);
  const State start = pack(scene);
  for (const State& state : trajectory(scene, start, 240)) EXPECT_LT(world.energy(state), world.energy(start) + 0.01);
}

// A small cube far from its pivot, which moves along its arm by far less than across it.
TEST(Loop, LongArmStaysClosedAtSpeed) {
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("post", Box{{0.02, 0.02, 0.02}}));
  Body cube = body("object", Box{{0.1, 0.1, 0.1}}, 1.0, {0.5, 0.0, 0.0}, Role::object);
  cube.state.angular_velocity = {0.0, 0.0, 10.0};
  cube.state.velocity = {0.0, 5.0, 0.0};
  scene.add_body(cube);
  scene.add_loop({"post", "object", LoopType::point, Vector3::Zero(), {-0.5, 0.0, 0.0}});
  EXPECT_LT(most_gap(scene, trajectory(scene, pack(scene), 480)), 0.1 * micrometre);
}

// A loop at the anchor of a joint says nothing that the joint does not.
TEST(Loop, ThatAJointClosesAlreadyChangesNothing) {
  const auto swung = [](bool tied) {
    Scene scene = rod_on_post(Vector3::UnitY(), down());
    if (tied) scene.add_loop({"post", "rod", LoopType::point, Vector3::Zero(), {-0.25, 0.0, 0.0}});
    return joint_in(scene, after(scene, pack(scene), 240), "hinge").position;
  };
  EXPECT_NEAR(swung(true), swung(false), 0.03);  // trees with loops do not coast
}

TEST(Loop, WorkOfAKinematicEndIsThatOfThePlan) {
  Scene scene(down());
  Body hand = body("hand", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.0, 1.0}, Role::effector);
  hand.kinematic = true;
  hand.state.velocity = {0.0, 0.0, 0.5};
  scene.add_body(hand);
  Body bag = body("object", Box{{0.05, 0.05, 0.05}}, 0.2, {0.0, 0.2, 1.0}, Role::object);
  bag.state.velocity = hand.state.velocity;
  scene.add_body(bag);
  scene.add_loop({"hand", "object", LoopType::weld, {0.0, 0.1, 0.0}, {0.0, -0.1, 0.0}});
  const Audit audit = *World(scene).rollout(pack(scene), {Wrench{}}, 1.0, true).audit;
  EXPECT_NEAR(audit.plan, 0.2 * g * 0.5, 0.01);
  EXPECT_NEAR(audit.joints, 0.0, 1e-6);
}

TEST(Loop, RefusesWhatItCannotTie) {
  Scene scene = hanging_box();
  const auto add = [&](const Loop& loop) { return [&scene, loop] { scene.add_loop(loop); }; };
  EXPECT_TRUE(rejects(add({"post", "nobody"}), {"loop 'post' - 'nobody'", "body", "'object'"}));
  EXPECT_TRUE(rejects(add({"post", "post"}), {"another body"}));
  scene.add_body(fixed("wall", Box{{0.1, 0.1, 0.1}}));
  EXPECT_TRUE(rejects(add({"post", "wall"}), {"at most one fixed"}));
  Loop turned{"post", "object"};
  turned.orientation_a.w() = 2.0;
  EXPECT_TRUE(rejects(add(turned), {"orientation_a"}));
}

// ---- tendons

// Two carts of 1 kg on vertical rails.
Scene carts(const Tendon& law) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("post", Box{{0.02, 0.02, 0.02}}));
  for (const auto& [name, y] : {std::pair{"a", 0.5}, {"b", -0.5}}) {
    scene.add_body(body(name, Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero(), y > 0.0 ? Role::object : Role::none));
    scene.add_joint(joint(name, JointType::prismatic, "post", name, Vector3::UnitZ(), {0.0, y, 0.0}));
  }
  scene.add_tendon(law);
  return scene;
}

Tendon over_both(double coefficient = 1.0) {
  Tendon tendon;
  tendon.name = "tendon";
  tendon.joints = {{"a", 1.0}, {"b", coefficient}};
  return tendon;
}

TEST(Tendon, SagsByTheWeightThatItCarries) {
  Tendon law = over_both();
  law.stiffness = 200.0;
  law.damping = 30.0;
  law.target = 0.4;
  const Scene scene = carts(law);
  const State end = after(scene, pack(scene), 1200);
  for (const char* cart : {"a", "b"}) {
    EXPECT_NEAR(joint_in(scene, end, cart).position, 0.5 * (0.4 - g / 200.0), 1e-4);
  }
  const double height = joint_in(scene, end, "a").position;
  EXPECT_NEAR(World(scene).energy(end), 2.0 * g * height + 0.5 * 200.0 * std::pow(g / 200.0, 2), 1e-3);
}

TEST(Tendon, StopsAtItsLimitAndHoldsByDryFriction) {
  Tendon stop = over_both();
  stop.lower = -0.3;
  const Scene stopped = carts(stop);
  const State end = after(stopped, pack(stopped), 480);
  EXPECT_NEAR(joint_in(stopped, end, "a").position, -0.15, 1e-4);
  Tendon sticky = over_both();
  sticky.friction = 1.2 * g;
  const Scene held = carts(sticky);
  EXPECT_NEAR(joint_in(held, after(held, pack(held), 480), "a").position, 0.0, 1e-4);
}

// What it does not pull on falls freely; what it pulls on comes as fast as its limit lets it.
TEST(Tendon, PullsNoHarderThanItsLimit) {
  Tendon law = over_both(-1.0);
  law.stiffness = 1e4;
  law.damping = 100.0;
  law.target = 5.0;
  law.torque_limit = 3.0;
  const Scene scene = carts(law);
  const State end = after(scene, pack(scene), 120);
  EXPECT_NEAR(joint_in(scene, end, "a").velocity, -0.5 * (g - 3.0), 1e-6);
  EXPECT_NEAR(joint_in(scene, end, "b").velocity, -0.5 * (g + 3.0), 1e-6);
}

TEST(Tendon, FollowsAPlan) {
  Tendon law = over_both(-1.0);
  law.stiffness = 400.0;
  law.damping = 40.0;
  const Scene scene = carts(law);
  Plan plan{1.0 / 240.0, {}, {{"tendon", Eigen::VectorXd::Constant(1200, 0.2)}}};
  const State end = after(scene, pack(scene), 1200, plan);
  EXPECT_NEAR(joint_in(scene, end, "a").position - joint_in(scene, end, "b").position, 0.2, 1e-6);
  plan.targets.front().joint = "nothing";
  EXPECT_TRUE(rejects([&] { validate(plan, scene); }, {"'nothing'"}));
}

TEST(Tendon, ItsWorkIsInTheAudit) {
  Tendon law = over_both(-0.5);
  law.stiffness = 400.0;
  law.damping = 4.0;
  law.target = 0.3;
  law.target_velocity = 0.1;
  law.friction = 0.5;
  const Scene scene = carts(law);
  const Audit audit = *World(scene).rollout(pack(scene), {Wrench{}}, 0.5, true).audit;
  EXPECT_LT(audit.damping, -1e-3);
  EXPECT_LT(audit.joints, -1e-3);
  EXPECT_LT(std::abs(audit.leftover()), 1e-9 * audit.turnover());
}

TEST(Tendon, RefusesWhatItCannotBe) {
  Scene scene = carts(over_both());
  const auto add = [&](Tendon tendon, const std::string& name = "other") {
    tendon.name = name;
    return [&scene, tendon] { scene.add_tendon(tendon); };
  };
  EXPECT_TRUE(rejects(add(over_both(), "tendon"), {"no other tendon"}));
  EXPECT_TRUE(rejects(add(over_both(), "a"), {"no joint has"}));
  EXPECT_TRUE(rejects(add(over_both(0.0)), {"'b'", "coefficient"}));
  Tendon tendon = over_both();
  tendon.joints[1].joint = "a";
  EXPECT_TRUE(rejects(add(tendon), {"twice"}));
  tendon.joints[1].joint = "c";
  EXPECT_TRUE(rejects(add(tendon), {"'c'", "'a', 'b'"}));
  tendon = over_both();
  tendon.lower = tendon.upper = 1.0;
  EXPECT_TRUE(rejects(add(tendon), {"lower limit"}));
  scene.add_body(body("third", Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero()));
  scene.add_joint(joint("third", JointType::prismatic, "post", "third", Vector3::UnitZ(), {0.5, 0.0, 0.0}));
  tendon = over_both();
  tendon.joints.push_back({"third", 1.0});
  EXPECT_TRUE(rejects(add(tendon), {"at most two"}));
  EXPECT_TRUE(rejects([&] { scene.add_joint(joint("tendon", JointType::fixed, "post", "third", Vector3::UnitZ())); },
                      {"no tendon has"}));
}

}  // namespace
}  // namespace energymargin

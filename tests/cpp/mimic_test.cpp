// Joints that follow other ones: where they are, what they weigh, what they pass on.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Joint following(Joint joint, const Mimic& mimic) {
  joint.mimic = mimic;
  return joint;
}

// Two rods of 0.5 m on one post, which turn about z: "leader" of 0.3 kg and "follower" of 0.2 kg.
Scene two_rods(const Mimic& mimic, const Joint& drive = {}) {
  Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive);
  scene.add_body(body("second", Box{{0.5, 0.04, 0.04}}, 0.2, Vector3::Zero()));
  scene.add_joint(following(
      joint("follower", JointType::revolute, "post", "second", Vector3::UnitZ(), {0.0, 0.0, 0.2}, {-0.25, 0.0, 0.0}),
      mimic));
  return scene;
}

constexpr double second_inertia = rod_inertia * 0.2 / 0.3;

// A rod of 0.3 kg that turns about z, and a cart of 0.2 kg that it drives along x as a pinion does a rack.
Scene rack_and_pinion(double radius) {
  Scene scene = rod_on_post(Vector3::UnitZ());
  scene.add_body(body("rack", Box{{0.2, 0.04, 0.04}}, 0.2, Vector3::Zero()));
  scene.add_joint(following(joint("follower", JointType::prismatic, "post", "rack", Vector3::UnitX(), {0.0, 0.0, 0.2}),
                            {"hinge", radius}));
  return scene;
}

// Carts of 2 kg and 0.5 kg on rails along x, the second on the first.
Scene cart_on_cart(const Mimic& mimic, const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("cart", Box{{0.2, 0.1, 0.1}}, 2.0, Vector3::Zero()));
  scene.add_body(body("second", Box{{0.1, 0.1, 0.1}}, 0.5, Vector3::Zero()));
  scene.add_joint(joint("hinge", JointType::prismatic, "post", "cart", Vector3::UnitX(), {0.0, 0.0, 0.3}));
  scene.add_joint(
      following(joint("follower", JointType::prismatic, "cart", "second", Vector3::UnitX(), {0.0, 0.0, 0.3}), mimic));
  return scene;
}

// A finger of two rods about y, the tip of which bends as far as its root.
Scene finger(const Vector3& gravity = Vector3::Zero(), double duration = step) {
  Stepping stepping = exact();
  stepping.step = duration;
  Scene scene(gravity, stepping);
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("root", Box{{0.3, 0.04, 0.04}}, 0.3, Vector3::Zero()));
  scene.add_body(body("tip", Box{{0.2, 0.04, 0.04}}, 0.2, Vector3::Zero()));
  scene.add_joint(
      joint("hinge", JointType::revolute, "post", "root", Vector3::UnitY(), Vector3::Zero(), {-0.15, 0.0, 0.0}));
  scene.add_joint(following(
      joint("follower", JointType::revolute, "root", "tip", Vector3::UnitY(), {0.15, 0.0, 0.0}, {-0.1, 0.0, 0.0}),
      {"hinge", 1.0, 0.2}));
  return scene;
}

State at(const Scene& scene, double position, double velocity = 0.0) {
  return pack(scene, {}, {{"hinge", {position, velocity}}});
}

// ---- where it is

TEST(Mimic, FollowerIsNoPartOfTheStateAndIsWhereItsMultiplierAndOffsetPutIt) {
  const Scene scene = two_rods({"hinge", -1.5, 0.3});
  EXPECT_EQ(StateLayout(scene).dimension(), 2);
  const Unpacked found = unpack(scene, at(scene, 0.4, 2.0));
  EXPECT_DOUBLE_EQ(found.joints.at("follower").position, -1.5 * 0.4 + 0.3);
  EXPECT_DOUBLE_EQ(found.joints.at("follower").velocity, -3.0);
  const BodyState second = found.bodies.at("second");
  EXPECT_LT(second.orientation.angularDistance(turn(-0.3, Vector3::UnitZ())), 1e-12);
  EXPECT_LT((second.position - Vector3(0.25 * std::cos(-0.3), 0.25 * std::sin(-0.3), 0.2)).norm(), 1e-12);
  EXPECT_LT((second.angular_velocity - Vector3(0.0, 0.0, -3.0)).norm(), 1e-12);
  EXPECT_TRUE(scene.body("second").state.position.isApprox(Vector3(0.25 * std::cos(0.3), 0.25 * std::sin(0.3), 0.2)));
}

TEST(Mimic, RackMovesByTheRadiusOfItsPinion) {
  const Scene scene = rack_and_pinion(0.05);
  const BodyState rack = body_in(scene, at(scene, 2.0, -3.0), "rack");
  EXPECT_LT((rack.position - Vector3(0.1, 0.0, 0.2)).norm(), 1e-15);
  EXPECT_LT((rack.velocity - Vector3(-0.15, 0.0, 0.0)).norm(), 1e-15);
}

// A cart that is driven along x, and one that follows it twice as far and pushes a ball ahead of it.
Scene pushing(bool one_tree) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("cart", Box{{0.2, 0.1, 0.1}}, 2.0, Vector3::Zero()));
  scene.add_body(body("second", Box{{0.1, 0.1, 0.1}}, 0.5, Vector3::Zero()));
  Joint lead = joint("hinge", JointType::prismatic, "post", "cart", Vector3::UnitX(), {0.0, 0.0, 0.5});
  lead.stiffness = 200.0;
  lead.damping = 20.0;
  lead.target = 0.5;
  scene.add_joint(lead);
  scene.add_joint(following(joint("follower", JointType::prismatic, one_tree ? "cart" : "post", "second",
                                  Vector3::UnitX(), {0.0, 0.0, one_tree ? 0.5 : 1.0}),
                            {"hinge", 2.0, 0.1}));
  scene.add_body(body("object", Sphere{0.02}, 0.3, {0.17, 0.0, 1.0}, Role::object));
  return scene;
}

TEST(Mimic, FollowerInTheSimulationIsWhereTheStateSaysThroughoutADrive) {
  for (const bool one_tree : {false, true}) {
    const Scene scene = pushing(one_tree);
    const std::vector<Frame> frames = World(scene).simulate(pack(scene), {}, 240, each_step(240));
    const auto place = [&](std::size_t frame, const std::string& name) {
      return body_in(scene, frames[frame].state, name).position.x();
    };
    int touching = 0;
    for (std::size_t i = 1; i < frames.size(); ++i) {
      for (const Contact& contact : frames[i].contacts) {
        // A contact says where the two were before the step.
        const double front = place(i - 1, "object") - 0.02 - contact.distance;
        EXPECT_NEAR(front, place(i - 1, "second") + 0.05, 2e-5) << one_tree << ", step " << i;
        ++touching;
      }
    }
    EXPECT_GT(touching, 20) << one_tree;
    EXPECT_GT(place(240, "second"), one_tree ? 1.5 : 1.0) << one_tree;
  }
}

TEST(Mimic, FollowerThatAPoorSolverLeavesBehindCatchesUp) {
  const Scene plain = pushing(false);
  Stepping poor;
  poor.iterations = 1;
  Scene scene(Vector3::Zero(), poor);
  for (const Body& made : plain.bodies()) scene.add_body(made);
  for (const Joint& made : plain.joints()) scene.add_joint(made);
  scene.add_spring({"object", "post", Vector3::Zero(), {0.17, 0.0, 1.0}, 20.0, 0.0, 2.0});  // keeps the ball in touch
  const std::vector<Frame> frames = World(scene).simulate(pack(scene), {}, 960, each_step(960));
  double away = 0.0;
  int touching = 0;
  for (std::size_t i = 481; i < frames.size(); ++i) {
    for (const Contact& contact : frames[i].contacts) {
      const State& before = frames[i - 1].state;
      const double front = body_in(scene, before, "object").position.x() - 0.02 - contact.distance;
      away = std::max(away, std::abs(front - body_in(scene, before, "second").position.x() - 0.05));
      ++touching;
    }
  }
  EXPECT_GT(touching, 400);
  EXPECT_LT(away, 1e-4);
}

TEST(Mimic, FollowerOfAHeldJointIsRigidWhereItIs) {
  Joint held;
  held.held = true;
  const Scene scene = two_rods({"hinge", -1.5, 0.3}, held);
  const State start = at(scene, 0.4);
  const Drive load = steady("second", {3.0, 4.0, 0.0}, {0.0, 0.0, 1.0}, 120);
  for (const State& state : trajectory(scene, start, 120, {0.0, {load}})) EXPECT_TRUE(same_bits(state, start));
  Scene with_probe = scene;
  with_probe.add_body(body("probe", Sphere{0.05}, 1.0, {std::cos(0.3), -std::sin(0.3), 0.2}));
  const State probing = at(with_probe, 0.4);
  EXPECT_NEAR(World(with_probe).distance(probing, "second", "probe"), 0.45, 1e-5) << "the rod points at it";
}

TEST(Mimic, FollowerStopsWhereTheOneItFollowsStopsAndNeitherBouncesBack) {
  Joint limited;
  limited.upper = 0.5;
  for (const double multiplier : {1.0, 2.0, -2.0, 5.0}) {
    const Scene scene = two_rods({"hinge", multiplier}, limited);
    for (const double speed : {3.0, 20.0}) {
      const State end = after(scene, at(scene, 0.0, speed), 240);
      // The stop gives a little under the blow, and brings the rod back at 1 mrad/s at most; that nothing brakes.
      EXPECT_LE(std::abs(end[1]), 1.1e-3) << multiplier;
      EXPECT_NEAR(end[0], 0.5, 1.1e-3) << multiplier;
      EXPECT_NEAR(joint_in(scene, end, "follower").position, end[0] * multiplier, 1e-6) << multiplier;
    }
  }
}

// ---- what it weighs

TEST(Mimic, PairOnOnePostHasTheSumOfTheInertiasThatTheMultiplierReflects) {
  for (const double multiplier : {1.0, -1.0, 2.0, 0.3}) {
    const Scene scene = two_rods({"hinge", multiplier});
    const double inertia = rod_inertia + multiplier * multiplier * second_inertia;
    const State by_leader =
        after(scene, at(scene, 0.0), 120, {0.0, {steady("rod", Vector3::Zero(), {0.0, 0.0, 0.2}, 120)}});
    EXPECT_NEAR(by_leader[1], 0.2 / inertia * 0.5, 1e-9) << multiplier;
    const State by_follower =
        after(scene, at(scene, 0.0), 120, {0.0, {steady("second", Vector3::Zero(), {0.0, 0.0, 0.2}, 120)}});
    EXPECT_NEAR(by_follower[1], multiplier * 0.2 / inertia * 0.5, 1e-9) << multiplier;
  }
}

TEST(Mimic, RackReflectsItsMassByTheSquareOfTheRadius) {
  const double radius = 0.3;
  const Scene scene = rack_and_pinion(radius);
  const double inertia = rod_inertia + 0.2 * radius * radius;
  const State turned = after(scene, at(scene, 0.0), 120, {0.0, {steady("rod", Vector3::Zero(), {0.0, 0.0, 0.1}, 120)}});
  EXPECT_NEAR(turned[1], 0.1 / inertia * 0.5, 1e-9);
  const State pulled =
      after(scene, at(scene, 0.0), 120, {0.0, {steady("rack", {0.7, 0.0, 0.0}, Vector3::Zero(), 120)}});
  EXPECT_NEAR(pulled[1], 0.7 * radius / inertia * 0.5, 1e-9);
}

TEST(Mimic, PairOnOneTreeHasTheMassOfBothInMotion) {
  for (const double multiplier : {1.0, -0.5, 3.0}) {
    const Scene scene = cart_on_cart({"hinge", multiplier});
    const double mass = 2.0 + 0.5 * (1.0 + multiplier) * (1.0 + multiplier);
    const State end = after(scene, at(scene, 0.0), 120, {0.0, {steady("cart", {3.0, 0.0, 0.0}, Vector3::Zero(), 120)}});
    EXPECT_NEAR(end[1], 3.0 / mass * 0.5, 1e-9) << multiplier;
  }
}

TEST(Mimic, PairFallsByTheWeightThatEachBringsDownItsRail) {
  const Scene scene = cart_on_cart({"hinge", 1.0}, {-g, 0.0, 0.0});
  const double mass = 2.0 + 4.0 * 0.5;
  const double weight = (2.0 + 2.0 * 0.5) * g;
  EXPECT_NEAR(after(scene, at(scene, 0.0), 240)[1], -weight / mass, 1e-9);
}

TEST(Mimic, DriveOfTheLeaderCarriesTheLoadOfTheFollower) {
  Joint drive;
  drive.stiffness = 2.0;
  drive.damping = 0.4;
  const Scene scene = two_rods({"hinge", -2.0}, drive);
  const Drive load = steady("second", Vector3::Zero(), {0.0, 0.0, 0.1}, 1200);
  EXPECT_NEAR(after(scene, at(scene, 0.0), 1200, {0.0, {load}})[0], -2.0 * 0.1 / 2.0, 1e-6);
}

TEST(Mimic, CompliantPairSwingsWithThePeriodOfItsReflectedInertia) {
  Joint drive;
  drive.stiffness = 1.0;
  const Scene scene = two_rods({"hinge", 2.0}, drive);
  const double rate = std::sqrt(1.0 / (rod_inertia + 4.0 * second_inertia));
  const double quarter = 0.5 * pi / rate;
  const int steps = static_cast<int>(std::lround(quarter / step));
  const std::vector<State> swing = trajectory(scene, at(scene, 0.1), steps + 10);
  // The implicit spring also damps: a share of rate step / 2 of each swing's phase.
  EXPECT_NEAR(swing[static_cast<std::size_t>(steps)][0], 0.0, 2e-3);
  EXPECT_NEAR(swing[static_cast<std::size_t>(steps)][1], -0.1 * rate, 0.02 * 0.1 * rate);
}

// Of a finger of two rods: all of it turns with the root, and the tip once more about its own joint.
TEST(Mimic, FreePairKeepsItsEnergyWithoutGravity) {
  const auto drift = [](double duration) {
    const Scene scene = finger(Vector3::Zero(), duration);
    const World world(scene);
    const State start = at(scene, 0.3, 3.0);
    const double energy = world.energy(start);
    double most = 0.0;
    for (const State& state : trajectory(scene, start, static_cast<int>(std::lround(2.0 / duration)))) {
      most = std::max(most, std::abs(world.energy(state) / energy - 1.0));
    }
    return most;
  };
  EXPECT_LT(drift(step), 0.03);
  EXPECT_LT(drift(step / 4.0), 0.3 * drift(step));
}

TEST(Mimic, FreePairOfRodsKeepsItsSpeedToTheLastDigits) {
  const Scene scene = two_rods({"hinge", -2.0, 0.1});
  const State end = after(scene, at(scene, 0.3, 3.0), 480);
  EXPECT_NEAR(end[1], 3.0, 1e-9);
  EXPECT_NEAR(end[0], 0.3 + 2.0 * 3.0, 1e-9);
}

TEST(Mimic, RolloutInTwoHalvesIsTheOneInOneGo) {
  const Scene scene = finger(downwards);
  const State start = at(scene, 0.3, 1.0);
  const State whole = after(scene, start, 240);
  for (const int half : {1, 100}) {
    EXPECT_LT((after(scene, after(scene, start, half), 240 - half) - whole).norm(), 1e-3) << half;
  }
}

// ---- what it passes on

// A gripper: two fingers on rails along x, the right one following the left one; the drive closes it with `force`.
Scene gripper(double multiplier, double force, bool with_wall) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("palm", Box{{0.3, 0.1, 0.02}}, {0.0, 0.0, 0.3}));
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "left" : "right";
    scene.add_body(body(name, Box{{0.02, 0.1, 0.1}}, 0.1, Vector3::Zero(), Role::effector, 1.0));
    Joint slide = joint(name, JointType::prismatic, "palm", name, {-side, 0.0, 0.0}, {0.1 * side, 0.0, -0.3});
    if (side < 0.0) {
      slide.stiffness = 2000.0;
      slide.damping = 60.0;
      slide.target = 1.0;
      slide.torque_limit = force;
    } else {
      slide.mimic = Mimic{"left", multiplier};
    }
    scene.add_joint(slide);
  }
  if (with_wall) {
    scene.add_body(fixed("object", Box{{0.04, 0.1, 0.1}}, {0.03, 0.0, 0.0}, 1.0));  // in the way of the right one alone
  } else {
    scene.add_body(body("object", Box{{0.1, 0.06, 0.06}}, 0.2, Vector3::Zero(), Role::object, 1.0));
  }
  return scene;
}

double force_of(const Frame& frame, const std::string& finger) {
  double sum = 0.0;
  for (const Contact& contact : frame.contacts) {
    if (contact.body_a == finger || contact.body_b == finger) sum += contact.normal_force;
  }
  return sum;
}

TEST(Mimic, GripperSqueezesWithHalfOfItsDriveOnEachSide) {
  for (const double force : {2.0, 20.0}) {
    const Scene scene = gripper(1.0, force, false);
    const Frame end = World(scene).simulate(pack(scene), {}, 480, {480}).front();
    EXPECT_NEAR(force_of(end, "left"), 0.5 * force, 0.01 * force) << force;
    EXPECT_NEAR(force_of(end, "right"), 0.5 * force, 0.01 * force) << force;
    EXPECT_LT(std::abs(body_in(scene, end.state, "object").position.x()), 1e-3) << force;
    EXPECT_NEAR(joint_in(scene, end.state, "left").position, 0.04, 1e-3) << force;
  }
}

TEST(Mimic, FollowerThatMeetsAWallPressesWithTheDrivesForceOverItsMultiplier) {
  for (const double multiplier : {1.0, 0.5, 2.0}) {
    const Scene scene = gripper(multiplier, 4.0, true);
    const Frame end = World(scene).simulate(pack(scene), {}, 480, {480}).front();
    EXPECT_NEAR(force_of(end, "right"), 4.0 / multiplier, 0.02 * 4.0 / multiplier) << multiplier;
    EXPECT_NEAR(joint_in(scene, end.state, "right").position, 0.04, 1e-3) << multiplier;
    EXPECT_NEAR(joint_in(scene, end.state, "left").velocity, 0.0, 1e-3) << multiplier;
  }
}

TEST(Mimic, GripperHoldsABoxAgainstGravityByFrictionForTwoSeconds) {
  Scene base = gripper(1.0, 10.0, false);
  Scene scene(downwards, exact());
  for (const Body& made : base.bodies()) scene.add_body(made);
  for (const Joint& made : base.joints()) scene.add_joint(made);
  const State gripped = after(base, pack(base), 240);
  const BodyState start = body_in(scene, gripped, "object");
  const BodyState end = body_in(scene, after(scene, gripped, 480), "object");
  EXPECT_LT((end.position - start.position).norm(), 1e-3);
  EXPECT_LT(end.velocity.norm(), 1e-3);
}

// ---- errors

// Adding a hinge that follows, changed by `change`, to a scene with a hinge, a follower and a weld.
template <typename Change>
auto adding(const Change& change) {
  return [change] {
    Scene scene = two_rods({"hinge"});
    for (const char* name : {"third", "welded"}) scene.add_body(body(name, Sphere{0.1}, 1.0, {0.0, 0.0, 5.0}));
    scene.add_joint(joint("weld", JointType::fixed, "post", "welded", Vector3::UnitZ(), {0.0, 0.0, 9.0}));
    Joint made = joint("third", JointType::revolute, "post", "third", Vector3::UnitZ(), {0.0, 0.0, 1.0});
    made.mimic = Mimic{"hinge", 2.0, 0.1};
    change(made);
    scene.add_joint(made);
  };
}

TEST(Mimic, JointThatCannotFollowIsRejectedByNameArgumentAndValue) {
  EXPECT_NO_THROW(adding([](Joint&) {})());
  const auto of = [](const std::string& name) { return adding([name](Joint& j) { j.mimic->joint = name; }); };
  EXPECT_TRUE(rejects(of("follower"), {"joint 'third'", "mimic", "'follower'", "moves, and follows no other"}));
  EXPECT_TRUE(rejects(of("weld"), {"joint 'third'", "mimic", "'weld'", "moves"}));
  EXPECT_TRUE(rejects(of("third"), {"joint 'third'", "'third'", "'hinge', 'follower', 'weld'"}));
  EXPECT_TRUE(rejects(of("elbow"), {"joint 'third'", "'elbow'", "'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.type = JointType::fixed; }), {"joint 'third'", "mimic", "fixed"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.mimic->multiplier = 0.0; }), {"mimic: multiplier", "0", "another"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.mimic->multiplier = nan; }), {"mimic: multiplier", "nan", "finite"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.mimic->offset = infinity; }), {"mimic: offset", "inf", "finite"}));
}

TEST(Mimic, FollowerHasNoLimitsNoDriveAndNoStateOfItsOwn) {
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.upper = 1.0; }), {"joint 'third'", "limits", "'hinge'", "stops where"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.lower = -1.0; }), {"joint 'third'", "limits", "'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.stiffness = 1.0; }), {"stiffness", "none of them", "'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.damping = 1.0; }), {"damping", "none of them", "'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.held = true; }), {"held", "none of them", "'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.state.position = 0.3; }), {"position", "not 0", "follows 'hinge'"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.state.velocity = 0.3; }), {"velocity", "not 0", "follows 'hinge'"}));
  const std::initializer_list<std::string> drive = {"target", "torque_limit", "'hinge' moves both"};
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.target = 0.3; }), drive));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.target = j.state.position = 0.3; }), {"position", "not 0"}));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.target_velocity = 0.3; }), drive));
  EXPECT_TRUE(rejects(adding([](Joint& j) { j.torque_limit = 0.0; }), drive));
  const Scene scene = two_rods({"hinge"});
  EXPECT_TRUE(rejects([&] { pack(scene, {}, {{"follower", {0.1, 0.0}}}); }, {"'follower'", "follows another"}));
  const Targets targets{"follower", Eigen::VectorXd::Zero(10)};
  EXPECT_TRUE(rejects([&] { World(scene).simulate(at(scene, 0.0), {0.0, {}, {targets}}, 10, {10}); },
                      {"targets['follower']", "without position control"}));
}

}  // namespace
}  // namespace energymargin

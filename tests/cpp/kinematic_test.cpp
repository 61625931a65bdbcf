// Bodies whose motion is prescribed: by the velocity they start with, or by a plan.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "energymargin/disturbances.hpp"
#include "energymargin/metrics/lower_bound.hpp"
#include "energymargin/plausibility.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Body kinematic(const std::string& name, const Shape& shape, const Vector3& position,
               const Vector3& velocity = Vector3::Zero(), const Vector3& spin = Vector3::Zero()) {
  Body made = body(name, shape, 1.0, position, Role::effector);
  made.kinematic = true;
  made.state.velocity = velocity;
  made.state.angular_velocity = spin;
  return made;
}

constexpr double speed = 0.2;

// A smooth hand of 1 kg, 5 cm behind a block of a ton on a table.
Scene heavy_push() {
  Scene scene;
  scene.add_body(fixed("table", Plane{}, Vector3::Zero(), 0.4));
  scene.add_body(body("object", Box{{0.4, 0.4, 0.4}}, 1000.0, {0.0, 0.3, 0.2}, Role::object, 1.0));
  Body hand = kinematic("hand", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 0.2}, {0.0, speed, 0.0});
  hand.friction = 0.0;
  scene.add_body(hand);
  return scene;
}

// A joint far away: then the other solver has all bodies.
Scene with_a_joint(Scene scene) {
  scene.add_body(fixed("post", Sphere{0.01}, {50.0, 0.0, 0.0}));
  scene.add_body(body("rod", Sphere{0.01}, 0.1, Vector3::Zero()));
  scene.add_joint(joint("hinge", JointType::revolute, "post", "rod", Vector3::UnitZ(), {0.1, 0.0, 0.0}));
  return scene;
}

// The hand carries a finger.
Scene with_a_finger(Scene scene) {
  scene.add_body(body("finger", Box{{0.02, 0.02, 0.1}}, 0.1, Vector3::Zero(), Role::effector));
  Joint hinge =
      joint("knuckle", JointType::revolute, "hand", "finger", Vector3::UnitX(), {0.0, 0.0, 0.06}, {0.0, 0.0, -0.06});
  hinge.stiffness = 5.0;
  hinge.damping = 0.05;
  scene.add_joint(hinge);
  return scene;
}

std::vector<Scene> each_way(const Scene& scene) { return {scene, with_a_joint(scene), with_a_finger(scene)}; }

Plan plan_of(const std::string& body, const Wrenches& velocities, int steps_per_row = 1) {
  Plan plan{steps_per_row * step};
  plan.velocities = {{body, velocities}};
  return plan;
}

Wrenches wild_rows(int rows, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  Wrenches velocities(rows, 6);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < 6; ++j) velocities(i, j) = (j < 3 ? 0.5 : 3.0) * draw(random);
  }
  return velocities;
}

// ---- where it is

TEST(Kinematic, HandPushesAHeavyBlockAtExactlyItsSpeed) {
  for (const Scene& scene : each_way(heavy_push())) {
    const State end = World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state;
    const BodyState hand = body_in(scene, end, "hand");
    EXPECT_NEAR((hand.position - Vector3(0.0, speed, 0.2)).norm(), 0.0, 1e-9);
    EXPECT_EQ(hand.velocity, Vector3(0.0, speed, 0.0));
    const BodyState block = body_in(scene, end, "object");
    EXPECT_NEAR(block.velocity.y(), speed, 1e-3);
    EXPECT_NEAR(block.position.y(), 0.25 + speed, 2e-3);
  }
}

TEST(Kinematic, PoseIsTheIntegralOfThePlansVelocitiesWhateverIsInTheWay) {
  constexpr int rows = 60;
  const Wrenches velocities = wild_rows(rows, 7);
  Scene crowd = heavy_push();
  for (int i = 0; i < 6; ++i) {
    const double angle = i * pi / 3.0;
    crowd.add_body(
        body("ball " + std::to_string(i), Sphere{0.05}, 3.0, {0.13 * std::cos(angle), 0.12 * std::sin(angle), 0.2}));
  }
  crowd.disable_collisions("ball 1", "object");
  for (const Scene& scene : each_way(crowd)) {
    BodyState expected = scene.body("hand").state;
    for (int i = 0; i < rows; ++i) {
      const Vector3 spin = velocities.row(i).tail<3>();
      expected.position += 4.0 * step * velocities.row(i).head<3>().transpose();
      expected.orientation = turn(4.0 * step * spin.norm(), spin.normalized()) * expected.orientation;
    }
    World world(scene, plan_of("hand", velocities, 4));
    const Rollout rollout = world.rollout(pack(scene), {Wrench{{5.0, -3.0, 1.0}, {0.1, 0.2, 0.3}}}, rows * 4.0 * step);
    const BodyState hand = body_in(scene, rollout.state, "hand");
    EXPECT_LT((hand.position - expected.position).norm(), 1e-9);
    EXPECT_LT(hand.orientation.angularDistance(expected.orientation), 1e-9);
    EXPECT_EQ(hand.velocity, Vector3(velocities.row(rows - 1).head<3>()));
    EXPECT_TRUE(same_bits(rollout.state,
                          World(scene, plan_of("hand", velocities, 4))
                              .rollout(pack(scene), {Wrench{{5.0, -3.0, 1.0}, {0.1, 0.2, 0.3}}}, rows * 4.0 * step)
                              .state));
  }
}

TEST(Kinematic, BodyGoesOnAsItMovesWithoutAPlanAndBehindItsEnd) {
  Scene scene(Vector3(0.0, 0.0, -g));
  Body hand = kinematic("hand", Box{{0.1, 0.2, 0.3}}, {0.0, 0.0, 1.0}, {0.1, 0.2, 0.3}, {1.0, 2.0, -0.5});
  hand.inertial = Inertial{{0.02, 0.0, 0.01}, {0.1, 0.2, 0.25}, turn(0.3, Vector3::UnitX())};
  scene.add_body(hand);
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  const BodyState free = body_in(scene, World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state, "hand");
  EXPECT_LT((free.position - Vector3(0.1, 0.2, 1.3)).norm(), 1e-9);
  EXPECT_LT(free.orientation.angularDistance(turn(std::sqrt(5.25), Vector3(1.0, 2.0, -0.5).normalized())), 1e-9);
  EXPECT_EQ(free.angular_velocity, Vector3(1.0, 2.0, -0.5));
  Wrenches row(1, 6);
  row << 0.0, 0.0, -1.0, 0.0, 0.0, 0.0;
  World world(scene, plan_of("hand", row, 24));
  const BodyState driven = body_in(scene, world.rollout(pack(scene), {Wrench{}}, 0.3).state, "hand");
  EXPECT_NEAR(driven.position.z(), 0.7, 1e-9);
  EXPECT_EQ(driven.orientation.coeffs(), Quaternion::Identity().coeffs());
}

TEST(Kinematic, LockedAxesStayLocked) {
  Scene scene = heavy_push();
  Body planar = kinematic("sledge", Sphere{0.1}, {9.0, 0.0, 0.1});
  planar.linear_factor = {1.0, 1.0, 0.0};
  planar.angular_factor = Vector3::UnitZ();
  scene.add_body(planar);
  World world(scene, plan_of("sledge", Wrenches::Constant(1, 6, 0.5), 240));
  const BodyState end = body_in(scene, world.rollout(pack(scene), {Wrench{}}, 1.0).state, "sledge");
  EXPECT_LT((end.position - Vector3(9.5, 0.5, 0.1)).norm(), 1e-9);
  EXPECT_LT(end.orientation.angularDistance(turn(0.5, Vector3::UnitZ())), 1e-9);
}

// ---- what it meets

TEST(Kinematic, FixedAndOtherKinematicBodiesAreNotInItsWay) {
  for (const bool finger : {false, true}) {
    Scene scene = heavy_push();
    scene.add_body(fixed("wall", Box{{1.0, 0.1, 1.0}}, {0.0, -1.0, 0.5}));
    scene.add_body(kinematic("other", Box{{0.1, 0.1, 0.1}}, {0.0, -0.5, 0.2}));
    if (finger) {
      scene.add_body(body("plate", Box{{0.1, 0.02, 0.1}}, 0.1, Vector3::Zero()));
      scene.add_joint(joint("weld", JointType::fixed, "hand", "plate", Vector3::UnitX(), {0.0, -0.06, 0.0}));
    }
    BodyState back = scene.body("hand").state;
    back.velocity = {0.0, -2.0, -0.1};
    World world(scene);
    const State start = pack(scene, {{"hand", back}});
    const State end = world.rollout(start, {Wrench{}}, 1.0).state;
    EXPECT_LT((body_in(scene, end, "hand").position - Vector3(0.0, -2.0, 0.1)).norm(), 1e-9);
    EXPECT_LT((body_in(scene, end, "object").position - Vector3(0.0, 0.3, 0.2)).norm(), 1e-3);
    back.position = {0.0, -1.0, 0.2};
    EXPECT_EQ(deepest_contact(world.scene(), pack(scene, {{"hand", back}})).distance, 0.0);
  }
}

TEST(Kinematic, FastPlateDoesNotPassThroughABall) {
  for (const bool joint : {false, true}) {
    Scene scene(Vector3::Zero());
    scene.add_body(kinematic("plate", Box{{0.004, 1.0, 1.0}}, {-0.3, 0.0, 0.0}, {40.0, 0.0, 0.0}));
    scene.add_body(body("object", Sphere{0.02}, 1.0, Vector3::Zero(), Role::object));
    if (joint) scene = with_a_joint(scene);
    const State end = World(scene).rollout(pack(scene), {Wrench{}}, 0.1).state;
    const BodyState plate = body_in(scene, end, "plate");
    EXPECT_NEAR(plate.position.x(), 3.7, 1e-9);
    EXPECT_GT(body_in(scene, end, "object").position.x(), plate.position.x() + 0.015);
    EXPECT_GE(body_in(scene, end, "object").velocity.x(), 40.0 - 1e-3);
  }
}

TEST(Kinematic, HandThatSqueezesABlockAgainstAWallKeepsItsPlan) {
  Scene scene = heavy_push();
  scene.add_body(fixed("wall", Box{{1.0, 0.1, 1.0}}, {0.0, 0.6, 0.5}));  // from 0.05 m behind the block on
  const State end = World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state;
  EXPECT_NEAR(body_in(scene, end, "hand").position.y(), speed, 1e-9);
  EXPECT_LT(body_in(scene, end, "object").position.y(), 0.4);
  EXPECT_TRUE(end.allFinite());
}

TEST(Kinematic, SpringPullsTheBallAfterItAndNotTheHandBack) {
  for (const Scene& scene : each_way(heavy_push())) {
    Scene tied = scene;
    tied.add_body(body("ball", Sphere{0.05}, 0.1, {2.0, 0.0, 0.2}));
    tied.add_spring({"hand", "ball", Vector3::Zero(), Vector3::Zero(), 20.0, 1.0, 0.2});
    const State end = World(tied).rollout(pack(tied), {Wrench{}}, 0.5).state;
    EXPECT_NEAR((body_in(tied, end, "hand").position - Vector3(0.0, 0.5 * speed, 0.2)).norm(), 0.0, 1e-9);
    EXPECT_LT(body_in(tied, end, "ball").position.x(), 1.5);
  }
}

// ---- links that it carries

Scene palm_of_hand(bool is_kinematic, const Vector3& velocity = Vector3::Zero()) {
  const Scene given = hand(1.0, true);
  Scene scene(given.gravity(), given.stepping());
  for (Body part : given.bodies()) {
    if (part.name == "palm" && is_kinematic) {
      part.mass = 1.0;
      part.kinematic = true;
    }
    if (!part.fixed()) part.state.velocity = velocity;
    scene.add_body(part);
  }
  for (const Joint& of : given.joints()) scene.add_joint(of);
  return scene;
}

TEST(Kinematic, FingersOnAPalmAtRestMoveAsOnAFixedOne) {
  const Scene moving = palm_of_hand(true);
  const Scene still = palm_of_hand(false);
  const Wrench wrench{{0.5, 0.2, -0.3}, {0.0, 0.01, 0.0}};
  const State a = World(moving).rollout(pack(moving), {wrench}, 0.3).state;
  const State b = World(still).rollout(pack(still), {wrench}, 0.3).state;
  for (const Joint& of : still.joints()) {
    if (!of.moves()) continue;
    EXPECT_NEAR(joint_in(moving, a, of.name).position, joint_in(still, b, of.name).position, 1e-4);
  }
  EXPECT_LT((body_in(moving, a, "object").position - body_in(still, b, "object").position).norm(), 1e-4);
}

TEST(Kinematic, HandThatMovesEvenlyHoldsAsOneAtRest) {
  const Vector3 velocity(0.4, -0.3, 0.2);
  const Scene moving = palm_of_hand(true, velocity);
  const Scene still = palm_of_hand(true);
  const State a = World(moving).rollout(pack(moving), {Wrench{}}, 0.3).state;
  const State b = World(still).rollout(pack(still), {Wrench{}}, 0.3).state;
  EXPECT_LT((body_in(moving, a, "palm").position - body_in(still, b, "palm").position - 0.3 * velocity).norm(), 1e-9);
  EXPECT_LT((body_in(moving, a, "object").position - body_in(still, b, "object").position - 0.3 * velocity).norm(),
            1e-5);
}

TEST(Kinematic, LinkThatSlidesFreelyStaysBehindABaseThatStarts) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(kinematic("hand", Box{{0.1, 0.1, 0.1}}, Vector3::Zero()));
  scene.add_body(body("bead", Sphere{0.02}, 0.3, Vector3::Zero()));
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  scene.add_joint(joint("rail", JointType::prismatic, "hand", "bead", Vector3::UnitX(), {0.0, 0.0, 0.2}));
  Wrenches row(1, 6);
  row << 0.5, 0.25, 0.0, 0.0, 0.0, 0.0;
  World world(scene, plan_of("hand", row, 240));
  const State end = world.rollout(pack(scene), {Wrench{}}, 1.0).state;
  EXPECT_NEAR(joint_in(scene, end, "rail").velocity, -0.5, 1e-12);
  EXPECT_LT((body_in(scene, end, "bead").position - Vector3(0.0, 0.25, 0.2)).norm(), 1e-9);
  EXPECT_LT((body_in(scene, end, "hand").position - Vector3(0.5, 0.25, 0.0)).norm(), 1e-9);
}

TEST(Kinematic, LinkOnABaseThatTurnsFeelsItsCentrifugalForce) {
  constexpr double rate = 2.0;
  Scene scene(Vector3::Zero(), Stepping{1e-4});
  scene.add_body(kinematic("hand", Box{{0.1, 0.1, 0.1}}, Vector3::Zero(), Vector3::Zero(), {0.0, 0.0, rate}));
  scene.add_body(body("bead", Sphere{0.02}, 0.3, Vector3::Zero()));
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  Joint rail = joint("rail", JointType::prismatic, "hand", "bead", Vector3::UnitX(), {0.0, 0.0, 0.2});
  rail.state.position = 0.1;
  scene.add_joint(rail);
  const State end = World(scene).rollout(pack(scene), {Wrench{}}, 0.5).state;
  EXPECT_NEAR(joint_in(scene, end, "rail").position, 0.1 * std::cosh(rate * 0.5), 1e-4);
}

// ---- the balance of energy

Audit audit(const Scene& scene, const Plan& plan, double duration) {
  return *World(scene, plan).rollout(pack(scene), {Wrench{}}, duration, true).audit;
}

// The impact brings the block to the hand's speed: half of what the hand gives then is lost.
TEST(Kinematic, WorkOfThePushIsWhatFrictionTakesTheImpactLosesAndTheBlockGains) {
  for (const Scene& scene : each_way(heavy_push())) {
    const Audit found = *World(scene).rollout(pack(scene), {Wrench{}}, 1.0, true).audit;
    const double way = speed * 1.0 - 0.05;
    EXPECT_NEAR(found.friction, -0.4 * 1000.0 * g * way, 0.01 * found.plan);
    EXPECT_NEAR(found.contacts, -0.5 * 1000.0 * speed * speed, 0.01 * found.plan);
    EXPECT_NEAR(found.plan, 0.4 * 1000.0 * g * way + 1000.0 * speed * speed, 0.01 * found.plan);
    EXPECT_LT(std::abs(found.leftover()), 1e-5 * found.turnover());
  }
}

TEST(Kinematic, LeftoverOfAPlanWithSpringsAndFingersIsSmall) {
  Wrenches rows = wild_rows(12, 3);
  rows.rightCols<3>() *= 0.2;
  rows.col(0).array() -= 1.0;  // it pulls the ball along
  for (const Scene& scene : each_way(heavy_push())) {
    Scene tied = scene;
    tied.add_body(body("ball", Sphere{0.05}, 0.1, {0.3, 0.0, 0.2}));
    tied.add_spring({"ball", "hand", {0.01, 0.0, 0.0}, {0.0, 0.03, 0.01}, 20.0, 0.2, 0.1});
    const Audit found = audit(tied, plan_of("hand", rows, 10), 0.5);
    EXPECT_GT(std::abs(found.plan), 0.01);
    EXPECT_LT(std::abs(found.leftover()), 1e-2 * found.turnover()) << found.leftover() << " of " << found.turnover();
  }
}

TEST(Kinematic, BodyHasNoEnergyOfItsOwn) {
  const Scene scene = heavy_push();
  BodyState away = scene.body("hand").state;
  away.position.z() = 7.0;
  away.velocity = {3.0, 0.0, 0.0};
  World world(scene);
  EXPECT_EQ(world.energy(pack(scene, {{"hand", away}})), world.energy(pack(scene)));
}

// ---- what is asked about it

Problem heavy_problem(const Scene& scene) {
  return problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.1, regions::Ball{"object", {0.0, 0.3, 0.2}, 0.1});
}

TEST(Kinematic, LowerBoundTakesABodyAtRestForFixedAndOneThatMovesForASourceOfWork) {
  const auto pen = [](bool is_kinematic, const Vector3& velocity) {
    Scene scene(Vector3::Zero());
    for (int i = 0; i < 4; ++i) {
      const Vector3 outward = turn(0.5 * pi * i, Vector3::UnitZ()) * Vector3::UnitX();
      Body wall = body("wall " + std::to_string(i), Box{{0.02, 0.24, 0.2}}, is_kinematic ? 1.0 : 0.0, 0.11 * outward);
      wall.state.orientation = turn(0.5 * pi * i, Vector3::UnitZ());
      wall.kinematic = is_kinematic;
      wall.state.velocity = velocity;
      scene.add_body(wall);
    }
    Body object = body("object", Sphere{0.03}, 0.2, Vector3::Zero(), Role::object);
    object.linear_factor = {1.0, 1.0, 0.0};
    object.angular_factor = Vector3::UnitZ();
    scene.add_body(object);
    return effort_lower_bound(problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.3,
                                         regions::Box{"object", Vector3::Zero(), {0.4, 0.4, infinity}}));
  };
  EXPECT_TRUE(pen(false, Vector3::Zero()).cage());
  EXPECT_TRUE(pen(true, Vector3::Zero()).cage());
  const LowerBound moving = pen(true, {0.1, 0.0, 0.0});
  EXPECT_EQ(moving.effort, 0.0);
  EXPECT_EQ(moving.reason, "'wall 0' is kinematic and moves, which does work");
}

TEST(Kinematic, MassOfTheBodyRaisesNoWarning) {
  Scene scene = heavy_push();
  EXPECT_EQ(implausible(scene).size(), 0u);
  Body feather = kinematic("feather", Box{{0.1, 0.1, 0.1}}, {5.0, 0.0, 1.0});
  feather.mass = 1e-9;
  scene.add_body(feather);
  EXPECT_EQ(implausible(scene).size(), 0u);
}

TEST(Kinematic, NoiseOfThePlanLeavesItAlone) {
  Scene scene = heavy_push();
  scene.add_body(body("tool", Sphere{0.05}, 0.3, {5.0, 0.0, 1.0}, Role::effector));
  Problem problem = heavy_problem(scene);
  problem.plan = hold(scene, problem.state, 0.1);
  const disturbances::ActuationNoise noise{Vector3::Constant(1.0)};
  ASSERT_EQ(problem.plan->velocities.size(), 2u);
  const auto drawn = draw(noise, problem, 24, 1, 0).plan;
  ASSERT_EQ(drawn->wrenches.size(), 1u);
  EXPECT_EQ(drawn->wrenches[0].body, "tool");
  Problem alone = heavy_problem(heavy_push());
  alone.plan = hold(alone.scene, alone.state, 0.1);
  EXPECT_TRUE(rejects([&] { validate(DisturbanceModel(noise), alone); }, {"disturbance", "kinematic bodies alone"}));
}

// ---- what cannot be

TEST(Kinematic, BodyThatCannotBeIsRejected) {
  const auto adding = [](const auto& change) {
    return [change] {
      Body made = kinematic("hand", Box{{0.1, 0.1, 0.1}}, Vector3::Zero());
      change(made);
      Scene().add_body(made);
    };
  };
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = 0.0; }), {"'hand'", "kinematic is true", "mass 0"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.role = Role::object; }), {"'hand'", "kinematic is true", "an object"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.force.z() = 1.0; }), {"'hand'", "force", "0 for a kinematic body"}));
}

TEST(Kinematic, JointsSpringsAndPlansThatCannotBeAreRejected) {
  Scene scene = heavy_push();
  scene.add_body(kinematic("other", Sphere{0.1}, {5.0, 0.0, 0.0}));
  EXPECT_TRUE(rejects([&] { scene.add_joint(joint("hinge", JointType::revolute, "object", "hand", Vector3::UnitX())); },
                      {"'hinge'", "child is 'hand'", "not kinematic"}));
  for (const char* end : {"table", "other"}) {
    EXPECT_TRUE(rejects([&] { scene.add_spring({"hand", end}); }, {"body_b", "at most one fixed or kinematic body"}));
  }
  Plan push = plan_of("hand", Wrenches::Zero(1, 6));
  push.velocities[0].force = 1.0;
  EXPECT_TRUE(rejects([&] { validate(push, scene); }, {"limits['hand']", "kinematic", "none"}));
  Plan wrench{step};
  wrench.wrenches = {{"hand", Wrenches::Zero(1, 6)}};
  EXPECT_TRUE(rejects([&] { validate(wrench, scene); }, {"wrenches['hand']", "kinematic body", "`velocities`"}));
}

}  // namespace
}  // namespace energymargin

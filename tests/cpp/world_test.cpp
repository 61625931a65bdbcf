// Rollouts: laws of motion and contact.

#include "energymargin/world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Wrench force(double x, double y = 0.0, double z = 0.0) {
  Wrench wrench;
  wrench.force = {x, y, z};
  return wrench;
}

State moving(const Scene& scene, const Vector3& velocity, const Vector3& angular_velocity = Vector3::Zero()) {
  BodyState object = scene.body("object").state;
  object.velocity = velocity;
  object.angular_velocity = angular_velocity;
  return pack(scene, {{"object", object}});
}

BodyState of(const Scene& scene, const State& state, const std::string& name = "object") {
  return unpack(scene, state).bodies.at(name);
}

std::vector<int> every_step(int steps) {
  std::vector<int> record(static_cast<std::size_t>(steps));
  std::iota(record.begin(), record.end(), 1);
  return record;
}

// Largest distance of the object's height from `height` over one second.
double deepest_dip(const Scene& scene, const State& start, double height) {
  double most = 0.0;
  for (const Frame& frame : World(scene).simulate(start, {}, 240, every_step(240))) {
    most = std::max(most, std::abs(of(scene, frame.state).position.z() - height));
  }
  return most;
}

// ---- without contact

TEST(World, FreeBodyGainsExactlyTheWorkDoneOnIt) {
  const Scene scene = free_body();
  World world(scene);
  const State start = moving(scene, {0.1, 0.2, -0.3}, {0.0, 0.0, 0.5});
  Wrench wrench = force(0.3, -0.2, 0.5);
  wrench.torque.z() = 0.1;
  const Rollout rollout = world.rollout(start, {wrench}, 1.5);
  EXPECT_NEAR(rollout.energy - world.energy(start), rollout.work, 1e-12);
  EXPECT_NEAR(of(scene, rollout.state).velocity.x(), 0.1 + 0.3 / 2.0 * 1.5, 1e-12);
  EXPECT_NEAR(of(scene, rollout.state).angular_velocity.z(), 0.5 + 0.1 * 1.5 / (2.0 * 1.16 / 12.0), 1e-12);
  EXPECT_EQ(rollout.steps, 360);
}

TEST(World, EffortCountsBrakingAndSpeedingUpWhileWorkLetsThemCancel) {
  const Scene scene = free_body(Box{}, 1.0);
  const Rollout rollout = World(scene).rollout(moving(scene, {-1.0, 0.0, 0.0}), {force(1.0)}, 2.0);
  EXPECT_NEAR(of(scene, rollout.state).velocity.x(), 1.0, 1e-12);
  EXPECT_NEAR(rollout.work, 0.0, 1e-12);
  EXPECT_NEAR(rollout.effort, 1.0, 1e-12);
}

TEST(World, ProjectileFollowsTheParabolaOfItsSteps) {
  const Scene scene = free_body(Sphere{0.1}, 1.0, {0.0, 0.0, -g});
  const Rollout rollout = World(scene).rollout(moving(scene, {2.0, 0.0, 3.0}), {Wrench{}}, 1.0);
  const BodyState end = of(scene, rollout.state);
  EXPECT_NEAR(end.position.x(), 2.0, 1e-12);
  EXPECT_NEAR(end.velocity.z(), 3.0 - g, 1e-12);
  // The velocity is stepped first: half a step more of fall than the parabola.
  EXPECT_NEAR(end.position.z(), 3.0 - 0.5 * g * (1.0 + step), 1e-12);
  EXPECT_EQ(rollout.effort, 0.0);
}

TEST(World, EnergyIsKineticPlusGravitational) {
  const Scene scene = free_body(Box{{1.0, 0.4, 0.2}}, 2.0, {0.0, 0.0, -g});
  BodyState object;
  object.position.z() = 3.0;
  object.orientation = turn(0.5 * pi, Vector3::UnitX());
  object.velocity = {1.0, 2.0, 2.0};
  object.angular_velocity.z() = 3.0;  // about the block's own y axis
  const double inertia = 2.0 / 12.0 * (1.0 + 0.04);
  EXPECT_NEAR(World(scene).energy(pack(scene, {{"object", object}})), 9.0 + 2.0 * g * 3.0 + 0.5 * inertia * 9.0, 1e-12);
}

TEST(World, DurationIsRoundedToWholeStepsAndNoneLeavesTheState) {
  const Scene scene = push_scene();
  World world(scene);
  EXPECT_EQ(world.rollout(pack(scene), {Wrench{}}, 0.1).steps, 24);
  const Rollout none = world.rollout(pack(scene), {force(1.0)}, 0.0);
  EXPECT_EQ(none.steps, 0);
  EXPECT_EQ(none.effort, 0.0);
  EXPECT_TRUE(none.state.isApprox(pack(scene), 1e-15));
}

// ---- friction

TEST(World, BlockPushedOverATableIsHeldBackByTheProductOfTheFrictionsTimesItsWeight) {
  const Scene scene = rough_table();
  const double acceleration = 6.0 - 1.0 * 0.5 * g;
  const Rollout rollout = World(scene).rollout(pack(scene), {force(6.0)}, 1.0);
  const BodyState end = of(scene, rollout.state);
  EXPECT_NEAR(end.velocity.x(), acceleration, 1e-9);
  EXPECT_NEAR(end.position.x(), 0.5 * acceleration * (1.0 + step), 1e-5);  // friction is late until its weight settles
  EXPECT_NEAR(rollout.effort, 6.0 * 0.5 * acceleration, 6e-5);
  EXPECT_NEAR(rollout.work, rollout.effort, 1e-12);
  EXPECT_LT(std::abs(end.position.y()) + end.orientation.vec().norm(), 1e-6);
}

TEST(World, BlockStopsSlidingAfterTheDistanceThatItsFrictionAllows) {
  const Scene scene = rough_table();
  const Rollout rollout = World(scene).rollout(moving(scene, {1.0, 0.0, 0.0}), {Wrench{}}, 1.0);
  const double distance = 1.0 / (2.0 * 0.5 * g);
  EXPECT_NEAR(of(scene, rollout.state).position.x(), distance, 0.5 * step);
  EXPECT_LT(of(scene, rollout.state).velocity.norm(), 1e-9);
}

TEST(World, BlockUnderAForceBelowFrictionRestsAndCostsNothing) {
  for (const Stepping& stepping : {exact(), Stepping{}}) {
    const Scene scene = rough_table(stepping);
    const Rollout rollout = World(scene).rollout(pack(scene), {force(4.0, 2.0)}, 1.0);
    EXPECT_LT((of(scene, rollout.state).position - Vector3(0.0, 0.0, 0.05)).norm(), 1e-4);
    EXPECT_LT(rollout.effort, 4e-4);
  }
}

TEST(World, DefaultSolverKeepsTheFrictionOfAPushedBlockToAPartInAThousand) {
  const Scene scene = rough_table(Stepping{});
  const Rollout rollout = World(scene).rollout(pack(scene), {force(6.0)}, 0.5);
  const double acceleration = 6.0 - 0.5 * g;
  EXPECT_NEAR(rollout.effort, 6.0 * 0.5 * acceleration * 0.25, 1e-3 * 6.0 * 0.5 * acceleration * 0.25);
}

TEST(World, BlockOnASlopeHoldsBelowTheFrictionAngleAndSlidesAboveIt) {
  const double friction_angle = std::atan(0.5);
  const auto slid = [](double angle) {
    Scene scene(Vector3(0.0, 0.0, -g), exact());
    const Quaternion tilt = turn(angle, Vector3::UnitY());
    scene.add_body(fixed("slope", Plane{tilt * Vector3::UnitZ(), 0.0}, Vector3::Zero(), 1.0));
    Body block = body("object", Box{{1.2, 0.4, 0.1}}, 1.0, tilt * Vector3(0.0, 0.0, 0.05), Role::object, 0.5);
    block.state.orientation = tilt;
    scene.add_body(block);
    const BodyState end = of(scene, World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state);
    return (end.position - block.state.position).dot(tilt * Vector3::UnitX());
  };
  EXPECT_LT(std::abs(slid(friction_angle - 0.02)), 1.5 * creeping * g * step);  // in a second
  const double angle = friction_angle + 0.1;
  const double acceleration = g * (std::sin(angle) - 0.5 * std::cos(angle));
  EXPECT_NEAR(slid(angle), 0.5 * acceleration * (1.0 + step), 1e-6);
}

// ---- standing and sliding

TEST(World, BoxCylinderHullCapsuleAndSphereRestOnAPlaneWithinTenMicrometres) {
  const Quaternion lying = turn(0.5 * pi, Vector3::UnitX());
  const std::vector<std::pair<Shape, Quaternion>> bodies{{Box{{0.2, 0.2, 0.1}}, Quaternion::Identity()},
                                                         {Cylinder{0.1, 0.1}, Quaternion::Identity()},
                                                         {Cylinder{0.05, 0.2}, lying},
                                                         {brick({0.2, 0.2, 0.1}), Quaternion::Identity()},
                                                         {Capsule{0.05, 0.2}, lying},
                                                         {Sphere{0.05}, Quaternion::Identity()}};
  for (const auto& [shape, orientation] : bodies) {
    const Scene scene = rough_table(Stepping{}, shape);
    BodyState start = scene.body("object").state;
    start.orientation = orientation;
    EXPECT_LT(deepest_dip(scene, pack(scene, {{"object", start}}), 0.05), 1e-5) << "shape " << shape.index();
  }
}

TEST(World, SphereCylinderBoxAndHullSlideWithoutSinking) {
  for (const Shape& shape :
       std::vector<Shape>{Sphere{0.05}, Cylinder{0.1, 0.1}, Box{{0.2, 0.2, 0.1}}, brick({0.2, 0.2, 0.1})}) {
    const Scene scene = rough_table(Stepping{}, shape);
    EXPECT_LT(deepest_dip(scene, moving(scene, {2.0, 0.0, 0.0}), 0.05), 2e-4) << "shape " << shape.index();
  }
}

TEST(World, SlidingSphereEndsRollingWithFiveSeventhsOfItsSpeed) {
  const Scene scene = rough_table(exact(), Sphere{0.05});
  const BodyState end = of(scene, World(scene).rollout(moving(scene, {1.0, 0.0, 0.0}), {Wrench{}}, 1.0).state);
  EXPECT_NEAR(end.velocity.x(), 5.0 / 7.0, 1e-3);
  EXPECT_NEAR(end.angular_velocity.y(), end.velocity.x() / 0.05, 1e-2);
}

TEST(World, PlanarBodyIsHeldBackByFrictionLikeAFreeOne) {
  Scene scene(Vector3(0.0, 0.0, -g), exact());
  scene.add_body(fixed("table", Plane{}, Vector3::Zero(), 1.0));
  Body block = body("object", Box{{0.4, 0.4, 0.1}}, 1.0, {0.0, 0.0, 0.05}, Role::object, 0.5);
  block.angular_factor = Vector3::UnitZ();
  scene.add_body(block);
  const BodyState end = of(scene, World(scene).rollout(pack(scene), {force(6.0)}, 0.5).state);
  EXPECT_NEAR(end.velocity.x(), 0.5 * (6.0 - 0.5 * g), 1e-6);
  EXPECT_LT(std::abs(end.velocity.y()) + end.angular_velocity.norm(), 1e-6);
}

TEST(World, PlanarBodyKeepsItsLockedAxesUnderAnyWrenchAndContact) {
  Scene scene;
  Body block = body("object", Box{{0.4, 0.2, 0.1}}, 1.0, {0.0, 0.0, 0.7}, Role::object);
  block.linear_factor = {1.0, 1.0, 0.0};
  block.angular_factor = Vector3::UnitZ();
  block.state.orientation = turn(0.4, Vector3::UnitX());
  block.state.angular_velocity = {0.0, 0.0, 3.0};
  scene.add_body(block);
  Body ball = body("ball", Sphere{0.1}, 1.0, {-0.5, 0.02, 0.75});
  ball.state.velocity = {2.0, 0.0, 0.5};
  scene.add_body(ball);
  Wrench wrench = force(0.5, 0.5, 5.0);
  wrench.torque = {1.0, -1.0, 0.1};
  const Rollout rollout = World(scene).rollout(pack(scene), {wrench}, 0.5);
  const BodyState end = of(scene, rollout.state);
  EXPECT_LT(of(scene, rollout.state, "ball").velocity.x(), 1.9) << "the ball did not hit the block";
  EXPECT_EQ(end.position.z(), 0.7);
  EXPECT_EQ(end.velocity.z(), 0.0);
  EXPECT_EQ(end.angular_velocity.head<2>(), Vector2::Zero());
  // Turned about z alone: the block's tilt against z is what it was.
  EXPECT_NEAR((end.orientation * Vector3::UnitZ()).z(), std::cos(0.4), 1e-9);
}

TEST(World, SimulateUnderASteadyWrenchOnTheObjectIsTheRollout) {
  const Scene scene = push_scene();
  World world(scene);
  Drive drive{"object", Wrenches::Zero(60, 6)};
  drive.wrenches.col(0).setConstant(0.7);
  const std::vector<int> record{0, 1, 20, 60};
  const std::vector<Frame> frames = world.simulate(pack(scene), {0.0, {drive}}, 60, record);
  ASSERT_EQ(frames.size(), record.size());
  EXPECT_EQ(frames[0].contacts.size(), world.contacts(pack(scene)).size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_NEAR(frames[i].time, record[i] * step, 1e-15);
    const State rolled = world.rollout(pack(scene), {force(0.7)}, record[i] * step).state;
    EXPECT_TRUE(frames[i].state.isApprox(rolled, record[i] == 0 ? 1e-15 : 0.0)) << "frame " << i;
  }
}

// ---- contacts and distances

TEST(World, RecordedMomentsOfARolloutAreTheEndsOfShorterOnes) {
  const Problem problem = push();
  World world(problem.scene);
  const Disturbance wrenches{force(0.4, -0.7)};
  Watch watch;
  watch.record = {1, 20, 60};
  const Rollout whole = world.rollout_unchecked(problem.state, {push(wrenches, 60)}, {}, watch);
  ASSERT_EQ(whole.recorded.size(), 3u);
  for (const Moment& moment : whole.recorded) {
    const Rollout shorter = world.rollout_unchecked(problem.state, {push(wrenches, moment.steps)});
    EXPECT_TRUE(same_bits(moment.state, shorter.state)) << moment.steps << " steps";
    EXPECT_EQ(moment.effort, shorter.effort) << moment.steps << " steps";
  }
  EXPECT_TRUE(same_bits(whole.recorded.back().state, whole.state));
}

TEST(World, RolloutEndsWithTheStepAtWhichItsCostReachesTheBound) {
  const Problem problem = push();
  World world(problem.scene);
  const Disturbance wrenches{force(0.4, -0.7)};
  const double whole = world.rollout_unchecked(problem.state, {push(wrenches, 60)}).effort;
  Watch watch;
  watch.cost = 1.0;
  watch.bound = 1.0 + 0.5 * whole;
  const Rollout half = world.rollout_unchecked(problem.state, {push(wrenches, 60)}, {}, watch);
  ASSERT_LT(half.steps, 60);
  EXPECT_TRUE(half.complete);
  EXPECT_GE(watch.cost + half.effort, watch.bound);
  const Rollout before = world.rollout_unchecked(problem.state, {push(wrenches, half.steps - 1)});
  EXPECT_LT(watch.cost + before.effort, watch.bound);
  const Rollout again = world.rollout_unchecked(problem.state, {push(wrenches, half.steps)});
  EXPECT_TRUE(same_bits(half.state, again.state));
  EXPECT_EQ(half.effort, again.effort);
}

TEST(World, ContactsCarryTheWeightAndFrictionOpposesSliding) {
  const Scene scene = rough_table();
  World world(scene);
  const auto sum = [&](const State& state) {
    double normal = 0.0;
    Vector3 tangential = Vector3::Zero();
    for (const Contact& contact : world.contacts(state)) {
      const double side = contact.body_a == "object" ? 1.0 : -1.0;
      EXPECT_NEAR(side * contact.normal.z(), 1.0, 1e-12);
      EXPECT_EQ(contact.friction, 0.5);
      normal += contact.normal_force;
      tangential += side * contact.tangential_force;
    }
    return std::make_pair(normal, tangential);
  };
  State settled = world.rollout(pack(scene), {Wrench{}}, 0.5).state;
  const auto [standing, none] = sum(settled);
  EXPECT_NEAR(standing, g, 1e-9);
  EXPECT_LT(none.norm(), 1e-9);
  settled.segment<3>(7) = Vector3(0.3, 0.4, 0.0);
  const auto [sliding, friction] = sum(settled);
  EXPECT_NEAR(sliding, g, 1e-9);
  EXPECT_TRUE(friction.isApprox(0.5 * g * Vector3(-0.6, -0.8, 0.0), 1e-5)) << friction.transpose();
}

TEST(World, ContactsOfTheDefaultSolverCarryTheWeightAtOnceToTheirSoftnessAndLaterToTheTolerance) {
  const Scene scene = rough_table(Stepping{});
  World world(scene);
  const auto load = [&](const State& state) {
    double normal = 0.0;
    for (const Contact& contact : world.contacts(state)) normal += contact.normal_force;
    return normal;
  };
  EXPECT_NEAR(load(pack(scene)), g, 2.0 * giving * g);
  EXPECT_NEAR(load(world.rollout(pack(scene), {Wrench{}}, 0.5).state), g, 10.0 * scene.stepping().residual() * g);
}

// Distance between two bodies of these shapes at these places, asked in both orders.
double distance(const Shape& a, const Vector3& at_a, const Shape& b, const Vector3& at_b,
                const Quaternion& turned_a = Quaternion::Identity()) {
  Scene scene;
  Body first = std::holds_alternative<Plane>(a) ? fixed("a", a, at_a) : body("a", a, 1.0, at_a);
  first.state.orientation = turned_a;
  scene.add_body(first);
  scene.add_body(std::holds_alternative<Plane>(b) ? fixed("b", b, at_b) : body("b", b, 1.0, at_b));
  World world(scene);
  const double one = world.distance(pack(scene), "a", "b");
  EXPECT_LT(std::abs(world.distance(pack(scene), "b", "a") / one - 1.0), 1e-6);
  return one;
}

TEST(World, DistancesAreThoseOfGeometry) {
  const Quaternion lying = turn(0.5 * pi, Vector3::UnitX());
  const Vector3 o = Vector3::Zero();
  EXPECT_NEAR(distance(Box{{1.0, 1.0, 1.0}}, o, Box{{0.4, 0.4, 0.4}}, {1.0, 0.2, 0.1}), 0.3, 1e-6);
  // Bullet rounds the corners of a hull to a ten-thousandth of its size.
  EXPECT_NEAR(distance(Box{{1.0, 1.0, 1.0}}, o, brick({0.4, 0.4, 0.4}), {1.0, 0.2, 0.1}), 0.3, 4e-5);
  EXPECT_NEAR(distance(Sphere{0.2}, {0.0, 0.0, 2.0}, Box{{1.0, 1.0, 1.0}}, o), 1.3, 1e-6);
  EXPECT_NEAR(distance(Sphere{0.2}, {3.0, 4.0, 0.0}, Sphere{0.3}, o), 4.5, 1e-6);
  EXPECT_NEAR(distance(Cylinder{0.2, 0.6}, {5.0, 5.0, 1.0}, Plane{}, o), 0.7, 1e-9);
  EXPECT_NEAR(distance(Cylinder{0.2, 0.6}, {5.0, 5.0, 1.0}, Plane{}, o, lying), 0.8, 1e-9);
  EXPECT_NEAR(distance(Capsule{0.2, 0.6}, {0.0, 0.0, 1.0}, Plane{Vector3::UnitZ(), 0.1}, o), 0.4, 1e-9);
  EXPECT_NEAR(distance(Box{{1.0, 1.0, 1.0}}, o, Plane{Vector3::UnitX(), -2.0}, o), 1.5, 1e-9);
}

TEST(World, DistanceBetweenPlanesIsInfinite) {
  Scene scene = free_body();
  scene.add_body(fixed("floor", Plane{}));
  scene.add_body(fixed("wall", Plane{Vector3::UnitX(), 0.0}));
  EXPECT_EQ(World(scene).distance(pack(scene), "floor", "wall"), infinity);
}

TEST(World, DistanceInPenetrationIsNegative) {
  const Vector3 o = Vector3::Zero();
  EXPECT_NEAR(distance(Box{{1.0, 1.0, 1.0}}, o, Box{{0.4, 0.4, 0.4}}, {0.68, 0.0, 0.0}), -0.02, 1e-6);
  EXPECT_NEAR(distance(Sphere{0.2}, {0.45, 0.0, 0.0}, Sphere{0.3}, o), -0.05, 1e-6);
  EXPECT_NEAR(distance(Cylinder{0.2, 0.6}, {0.0, 0.0, 0.25}, Plane{}, o), -0.05, 1e-9);
}

TEST(World, DeepestContactNamesThePairThatIsDeepest) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(fixed("wall", Box{{1.0, 1.0, 1.0}}, {0.58, 0.0, 0.5}));
  scene.add_body(body("object", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, 0.09}, Role::object));
  const Contact contact = deepest_contact(scene, pack(scene));
  EXPECT_EQ(contact.body_a + " " + contact.body_b, "wall object");
  EXPECT_NEAR(contact.distance, -0.02, 1e-6);
  EXPECT_NEAR(contact.normal.x(), 1.0, 1e-6);
  BodyState apart;
  apart.position = {-1.0, 0.0, 1.0};
  EXPECT_EQ(deepest_contact(scene, pack(scene, {{"object", apart}})).distance, 0.0);
}

// ---- errors

TEST(World, BadArgumentsAreRejectedByNameAndValue) {
  const Scene scene = push_scene();
  World world(scene);
  const State start = pack(scene);
  State broken = start;
  broken[0] = nan;
  EXPECT_TRUE(
      rejects([&] { world.rollout(broken, {Wrench{}}, 0.1); }, {"state", "'object'", "position", "nan", "finite"}));
  EXPECT_TRUE(rejects([&] { world.rollout(State::Zero(3), {Wrench{}}, 0.1); }, {"state", "3", "26"}));
  EXPECT_TRUE(rejects([&] { world.rollout(start, {force(nan)}, 0.1); }, {"force", "nan", "finite"}));
  EXPECT_TRUE(rejects([&] { world.rollout(start, {Wrench{}}, -0.1); }, {"duration", "-0.1", "at least 0"}));
  EXPECT_TRUE(rejects([&] { world.distance(start, "object", "cup"); }, {"'cup'", "'effector'"}));
  EXPECT_TRUE(rejects([&] { world.distance(start, "object", "object"); }, {"body_b", "another body"}));
  EXPECT_TRUE(rejects([&] { world.simulate(start, {}, 0, {}); }, {"steps", "0", "at least 1"}));
  const Drive drive{"table", Wrenches::Zero(5, 6)};
  EXPECT_TRUE(
      rejects([&] { world.simulate(start, {0.0, {drive}}, 5, {5}); }, {"drives['table']", "fixed", "can move"}));
  const Drive few{"effector", Wrenches::Zero(4, 6)};
  EXPECT_TRUE(
      rejects([&] { world.simulate(start, {0.0, {few}}, 5, {5}); }, {"drives['effector']", "4 rows", "5 rows"}));
  EXPECT_TRUE(rejects([&] { world.simulate(start, {}, 5, {6}); }, {"record", "6", "0 to 5"}));
  EXPECT_TRUE(rejects([&] { world.simulate(start, {}, 5, {3, 2}); }, {"record", "2", "ascending"}));
  Scene empty;
  empty.add_body(fixed("table", Plane{}));
  EXPECT_TRUE(rejects([&] { World(empty).rollout(State(), {Wrench{}}, 0.1); }, {"scene", "object"}));
}

TEST(World, DurationOfMoreStepsThanCanBeCountedIsRejected) {
  const Scene scene = free_body();
  const double counter_full_twice = 4294967296.0 * step;
  EXPECT_TRUE(
      rejects([&] { World(scene).rollout(pack(scene), {Wrench{}}, counter_full_twice); }, {"duration", "1.78957e+07"}));
}

TEST(World, ThinPlatesAndCardsRestOnThePlaneWithTheirWholeThickness) {
  for (const Vector3& size : {Vector3(1.0, 1.0, 0.01), Vector3(0.0856, 0.054, 0.00076), Vector3(0.3, 0.2, 0.003)}) {
    Scene scene;
    Body ground;
    ground.name = "ground";
    ground.shape = Plane{};
    scene.add_body(ground);
    scene.add_body(body("plate", Box{size}, 1.0, {0.0, 0.0, 0.5 * size.z()}, Role::object));
    const State end = World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state;
    EXPECT_NEAR(end[2], 0.5 * size.z(), 1e-5) << size.transpose();
  }
}

// How far a square slides along a support that turns from -4.5 deg at 8.6 deg/s, in the plane of x and y.
double slid_on_a_turning_support(const Shape& square, double seconds) {
  constexpr double start_angle = -0.08;
  Scene scene({0.0, -g, 0.0});
  const auto planar = [](Body body, const Quaternion& orientation) {
    body.linear_factor = {1.0, 1.0, 0.0};
    body.angular_factor = {0.0, 0.0, 1.0};
    body.state.orientation = orientation;
    body.state.angular_velocity = {0.0, 0.0, -0.15};
    body.friction = 0.4;
    return body;
  };
  const Quaternion tilt = turn(start_angle, Vector3::UnitZ());
  const Vector3 above = tilt * Vector3(0.0, 0.3 - 1e-5, 0.0);
  Body support = planar(body("support", Box{{1.2, 0.2, 0.1}}, 1000.0, Vector3::Zero()), tilt);
  support.force = {0.0, 1001.0 * g, 0.0};
  Body object = planar(body("object", square, 1.0, above), tilt);
  object.role = Role::object;
  object.state.velocity = object.state.angular_velocity.cross(above);
  scene.add_body(support);
  scene.add_body(object);
  const State end = World(scene).rollout(pack(scene), {Wrench{}}, seconds).state;
  const BodyState bar = of(scene, end, "support");
  return (bar.orientation.conjugate() * (of(scene, end).position - bar.position)).x();
}

TEST(World, SquareOnASupportThatTurnsSlidesFromTheFrictionAngleOn) {
  for (const Shape& square : {Shape(Box{{0.4, 0.4, 0.1}}), Shape(brick({0.4, 0.4, 0.1}))}) {
    const double friction_angle = std::atan(0.4 * 0.4);  // 9.1 deg, reached after 0.5 s
    EXPECT_LT(std::abs(slid_on_a_turning_support(square, (friction_angle - 0.08) / 0.15)), 5e-3);
    EXPECT_GT(slid_on_a_turning_support(square, (friction_angle - 0.08) / 0.15 + 0.6), 0.03);
  }
}

}  // namespace
}  // namespace energymargin

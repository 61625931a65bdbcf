// The balance of energy of a rollout.

#include "energymargin/audit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "energymargin/world.hpp"
#include "random_mechanisms.hpp"
#include "step_parts.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Audit audit(const Scene& scene, const State& state, double duration, const Wrench& wrench = {}) {
  return *World(scene).rollout(state, {wrench}, duration, true).audit;
}

// For scenes that are about something else.
void add_bystander(Scene& scene) { scene.add_body(body("object", Sphere{0.1}, 1.0, {90.0, 0.0, 0.0}, Role::object)); }

// A ball of 0.5 kg that flies at the upper side of what is at the origin, off its centre.
void add_missile(Scene& scene, const Vector3& position, const Vector3& velocity) {
  Body ball = body("object", Sphere{0.05}, 0.5, position, Role::object, 0.8);
  ball.state.velocity = velocity;
  ball.state.angular_velocity = {3.0, -20.0, 5.0};
  scene.add_body(ball);
}

// A rod on a hinge that is driven, and an object far away.
Scene driven_rod(double stiffness, double damping, const Vector3& gravity = Vector3::Zero()) {
  Joint drive;
  drive.stiffness = stiffness;
  drive.damping = damping;
  Scene scene = rod_on_post(Vector3::UnitY(), gravity, drive);
  add_bystander(scene);
  return scene;
}

// ---- the balance

TEST(Audit, ChangesNoBitOfTheRollout) {
  Scene springs = push_scene();
  Spring tie;
  tie.body_a = "table";
  tie.body_b = "effector";
  tie.stiffness = 20.0;
  tie.damping = 2.0;
  springs.add_spring(tie);
  for (const Scene& scene : {push_scene(), springs, hand(), hand(1.0, true)}) {
    const Wrench wrench{{0.7, 0.5, 0.1}, {0.0, 0.01, 0.03}};
    World world(scene);
    const Rollout plain = world.rollout(pack(scene), {wrench}, 0.4);
    const Rollout audited = world.rollout(pack(scene), {wrench}, 0.4, true);
    const Rollout again = world.rollout(pack(scene), {wrench}, 0.4);
    EXPECT_FALSE(plain.audit);
    ASSERT_TRUE(audited.audit);
    for (const Rollout& other : {audited, again}) {
      EXPECT_TRUE(same_bits(plain.state, other.state));
      EXPECT_TRUE(same_bits(plain.effort, other.effort));
      EXPECT_TRUE(same_bits(plain.work, other.work));
      EXPECT_TRUE(same_bits(plain.energy, other.energy));
    }
  }
}

TEST(Audit, EntriesAndLeftoverAddUpToTheChangeOfEnergy) {
  for (const Scene& scene : {push_scene(), hand(1.0, true)}) {
    World world(scene);
    const Rollout rollout = world.rollout(pack(scene), {Wrench{{0.7, 0.5, 0.1}, {0.0, 0.01, 0.03}}}, 0.4, true);
    const Audit& found = *rollout.audit;
    EXPECT_EQ(found.energy_change, rollout.energy - world.energy(pack(scene)));
    EXPECT_EQ(found.wrench, rollout.work);
    const double works = found.wrench + found.friction + found.contacts + found.joints + found.damping + found.drives +
                         found.overlap + found.integration;
    EXPECT_NEAR(works + found.leftover(), found.energy_change, 1e-15 * found.turnover());
    EXPECT_GT(found.turnover(), 0.01);
    EXPECT_LT(found.friction, 0.0);
  }
}

TEST(Audit, NoStepsTurnNothingOver) {
  const Scene scene = push_scene();
  const Audit found = audit(scene, pack(scene), 0.0, {{1.0, 0.0, 0.0}, Vector3::Zero()});
  EXPECT_EQ(found.turnover(), 0.0);
  EXPECT_EQ(found.leftover(), 0.0);
}

TEST(Audit, FreeBodyGainsTheWorkOfTheWrench) {
  const Scene scene = free_body(Sphere{0.1});
  const State state =
      pack(scene, {{"object", {Vector3::Zero(), Quaternion::Identity(), {0.3, 0.0, -0.2}, {1.0, 2.0, 3.0}}}});
  const Audit found = audit(scene, state, 1.0, {{0.8, -0.4, 0.3}, {0.01, 0.02, -0.01}});
  EXPECT_GT(std::abs(found.wrench), 0.1);
  EXPECT_NEAR(found.energy_change, found.wrench, 1e-12 * found.turnover());
  EXPECT_EQ(found.friction, 0.0);
  EXPECT_EQ(found.contacts, 0.0);
}

// ---- contacts

TEST(Audit, FrictionTakesTheKineticEnergyOfABlockThatSlidesToRest) {
  const Scene scene = rough_table();
  const double speed = 1.5;
  BodyState sliding = scene.body("object").state;
  sliding.velocity.x() = speed;
  World world(scene);
  const Rollout rollout = world.rollout(pack(scene, {{"object", sliding}}), {Wrench{}}, 1.0, true);
  const Audit& found = *rollout.audit;
  EXPECT_NEAR(found.friction, -0.5 * speed * speed, 1e-7);
  const double distance = rollout.state[0];
  EXPECT_NEAR(found.friction, -0.5 * g * distance, 0.5 * step * 0.5 * g * speed);  // mu m g distance
  EXPECT_NEAR(found.contacts, 0.0, g * 10.0 * giving * g * step * step);           // its weight sinks
  EXPECT_NEAR(found.leftover(), 0.0, 1e-9);
}

TEST(Audit, BlockThatAWrenchCannotMoveTurnsNothingOver) {
  const Scene scene = rough_table();
  const Audit found = audit(scene, pack(scene), 0.5, {{0.4 * g, 0.0, 0.0}, Vector3::Zero()});  // friction bears 0.5 g
  EXPECT_NEAR(found.turnover(), 0.0, 1e-4);  // it creeps and sinks by some micrometres
}

TEST(Audit, LandingBallLosesItsKineticEnergyInContacts) {
  const double height = 0.3;
  Scene scene({0.0, 0.0, -g}, exact());
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", Sphere{0.1}, 2.0, {0.0, 0.0, 0.1 + height}, Role::object));
  const Audit found = audit(scene, pack(scene), 1.0);
  EXPECT_NEAR(found.energy_change, -2.0 * g * height, 2.0 * g * 6.0 * giving * g * step * step);  // and it sinks
  EXPECT_NEAR(found.contacts, -2.0 * g * height, 2.0 * g * std::sqrt(2.0 * g * height) * step);
  EXPECT_NEAR(found.friction, 0.0, 1e-12);
}

// Half a step's weight times the change of velocity: the velocity after the step moves, the mean velocity works.
TEST(Audit, IntegrationOfAFallIsHalfAStepOfTheWeightsPower) {
  const Scene scene = free_body(Sphere{0.1}, 2.0, {0.0, 0.0, -g});
  const Audit found = audit(scene, pack(scene), 0.5);
  EXPECT_NEAR(found.integration, -0.5 * step * 2.0 * g * (g * 0.5), 1e-9);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12);
}

TEST(Audit, BlockThatIsLiftedOutOfTheTableGainsItsWeightTimesTheLift) {
  const Scene scene = rough_table(exact(), Box{{0.4, 0.4, 0.1}}, 0.05 - 1e-3);
  const Audit found = audit(scene, pack(scene), 1.0);
  EXPECT_GT(found.energy_change, 0.9 * g * 1e-3);
  EXPECT_GT(found.overlap, 0.5 * found.energy_change);
  EXPECT_NEAR(found.overlap + found.contacts, found.energy_change, 1e-9);  // contacts lift at 1 mm/s at most
  EXPECT_NEAR(found.leftover(), 0.0, 1e-9);
}

TEST(Audit, ImpactOfTwoBallsIsContactsAndFriction) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(body("target", Sphere{0.1}, 1.0, Vector3::Zero(), Role::none, 0.8));
  add_missile(scene, {0.02, 0.01, 0.3}, {0.1, 0.3, -2.0});
  const Audit found = audit(scene, pack(scene), 0.3);
  EXPECT_LT(found.contacts, -0.1);
  EXPECT_LT(found.friction, -0.01);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover());
}

TEST(Audit, ImpactOnALinkIsContactsAndFriction) {
  Scene scene = rod_on_post(Vector3::UnitY());
  add_missile(scene, {0.4, 0.01, 0.2}, {0.1, 0.3, -2.0});
  const Audit found = audit(scene, pack(scene), 0.3);
  EXPECT_LT(found.contacts, -0.01);
  EXPECT_LT(found.friction, -0.01);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover());
}

TEST(Audit, ImpactOfTwoTreesIsContactsAndFriction) {
  Scene scene = rod_on_post(Vector3::UnitY());
  scene.add_body(fixed("second post", Box{{0.1, 0.1, 0.1}}, {0.8, 0.0, 0.2}));
  scene.add_body(body("second rod", Capsule{0.02, 0.4}, 0.4, Vector3::Zero()));
  Joint hinge = joint("second hinge", JointType::revolute, "second post", "second rod", Vector3::UnitY(),
                      Vector3::Zero(), {0.0, 0.0, 0.25});
  hinge.state = {0.5, 4.0};
  scene.add_joint(hinge);
  add_bystander(scene);
  const Audit found = audit(scene, pack(scene), 0.3);
  EXPECT_LT(found.contacts, -0.01);
  EXPECT_LT(found.friction, -0.001);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover());
}

// ---- springs and joints

TEST(Audit, SpringKeepsTheEnergyOfASwing) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("object", Sphere{0.1}, 1.5, {0.0, 0.0, -0.6}, Role::object));
  Spring spring;
  spring.body_a = "post";
  spring.body_b = "object";
  spring.stiffness = 40.0;
  spring.rest_length = 0.5;
  scene.add_spring(spring);
  const State swinging =
      pack(scene, {{"object", {{0.0, 0.0, -0.6}, Quaternion::Identity(), {1.0, 0.0, 0.0}, Vector3::Zero()}}});
  const Audit found = audit(scene, swinging, 2.0);
  EXPECT_EQ(found.damping, 0.0);
  EXPECT_NEAR(found.leftover(), 0.0, 0.02 * World(scene).energy(swinging));
}

TEST(Audit, DampedSpringLosesItsEnergyInDamping) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("object", Sphere{0.1}, 1.5, {0.0, 0.0, -0.6}, Role::object));
  Spring spring;
  spring.body_a = "post";
  spring.body_b = "object";
  spring.stiffness = 40.0;
  spring.rest_length = 0.5;
  spring.damping = 5.0;
  scene.add_spring(spring);
  const double energy = 0.5 * 40.0 * 0.1 * 0.1;
  const Audit found = audit(scene, pack(scene), 4.0);
  EXPECT_NEAR(found.energy_change, -energy, 1e-6);
  EXPECT_NEAR(found.damping, -energy, 0.03 * energy);
}

TEST(Audit, DampedJointLosesItsKineticEnergyInDamping) {
  const Scene scene = driven_rod(0.0, 0.2);
  const Audit found = audit(scene, pack(scene, {}, {{"hinge", {0.0, 3.0}}}), 4.0);
  const double energy = 0.5 * rod_inertia * 9.0;
  EXPECT_NEAR(found.energy_change, -energy, 1e-6 * energy);
  EXPECT_NEAR(found.damping, -energy, 1e-6 * energy);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12);
}

// Integrated implicitly, its stiffness damps as stiffness * step would.
TEST(Audit, CompliantJointLosesItsEnergyInDampingAndInIntegration) {
  const double stiffness = 2.0;
  const double damping = 0.05;
  const Scene scene = driven_rod(stiffness, damping);
  const State state = pack(scene, {}, {{"hinge", {0.4, 0.0}}});
  const Audit found = audit(scene, state, 6.0);
  const double energy = 0.5 * stiffness * 0.4 * 0.4;
  const double part = damping / (damping + step * stiffness);
  EXPECT_NEAR(found.energy_change, -energy, 1e-5 * energy);
  EXPECT_NEAR(found.damping, -energy * part, 1e-4 * energy);
  EXPECT_NEAR(found.integration, -energy * (1.0 - part), 1e-4 * energy);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12);
}

TEST(Audit, DriveToAVelocityPaysForTheKineticEnergyAndItsOwnDamping) {
  Joint drive;
  drive.damping = 0.2;
  drive.target_velocity = 5.0;
  Scene scene = rod_on_post(Vector3::UnitY(), Vector3::Zero(), drive);
  add_bystander(scene);
  const Audit found = audit(scene, pack(scene), 2.0);
  const double energy = 0.5 * rod_inertia * 25.0;
  EXPECT_NEAR(found.energy_change, energy, 1e-6 * energy);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12);
  // The motor gives damping * target velocity * angle; the shaft lags behind by inertia / damping seconds.
  EXPECT_NEAR(found.drives, 0.2 * 5.0 * 5.0 * (2.0 - rod_inertia / 0.2), 0.03);
}

// Its torque is the limit, and works as a weight does: damping has no room.
TEST(Audit, DriveBeyondItsTorqueLimitNeitherDampsNorDrives) {
  Joint drive;
  drive.stiffness = 100.0;
  drive.damping = 1.0;
  drive.target = 50.0;
  drive.torque_limit = 0.1;
  Scene scene = rod_on_post(Vector3::UnitY(), Vector3::Zero(), drive);
  add_bystander(scene);
  const Audit found = audit(scene, pack(scene), 1.0);
  EXPECT_EQ(found.damping, 0.0);
  EXPECT_EQ(found.drives, 0.0);
  const double speed = 0.1 / rod_inertia;  // after one second
  EXPECT_NEAR(found.integration, -0.5 * step * 0.1 * speed, 1e-9);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12);
}

TEST(Audit, StopTakesTheKineticEnergyOfAJoint) {
  Joint drive;
  drive.upper = 0.5;
  Scene scene = rod_on_post(Vector3::UnitY(), Vector3::Zero(), drive);
  add_bystander(scene);
  const Audit found = audit(scene, pack(scene, {}, {{"hinge", {0.0, 2.0}}}), 1.0);
  const double energy = 0.5 * rod_inertia * 4.0;
  EXPECT_NEAR(found.energy_change, -energy, 1e-9 * energy);
  EXPECT_NEAR(found.joints, -energy, 1e-9 * energy);
}

TEST(Audit, MimicJointPassesEnergyOn) {
  Scene scene = rod_on_post(Vector3::UnitY());
  scene.add_body(fixed("second post", Box{{0.1, 0.1, 0.1}}, {2.0, 0.0, 0.0}));
  scene.add_body(body("second rod", Capsule{0.02, 0.4}, 0.4, Vector3::Zero()));
  Joint follower = joint("second hinge", JointType::revolute, "second post", "second rod", Vector3::UnitY());
  follower.mimic = Mimic{"hinge", -2.0, 0.0};
  scene.add_joint(follower);
  add_bystander(scene);
  const State state = pack(scene, {}, {{"hinge", {0.0, 2.0}}});
  const Audit found = audit(scene, state, 1.0);
  EXPECT_NEAR(found.joints, 0.0, 1e-9 * World(scene).energy(state));
  EXPECT_NEAR(found.leftover(), 0.0, 1e-9 * World(scene).energy(state));
}

// ---- impacts within a step, which is cut there

TEST(Audit, FastBallLosesAtAThinWallTheEnergyOfItsMotionAcross) {
  for (const double speed : {5.0, 10.0, 20.0, 60.0}) {
    Scene scene(Vector3::Zero(), exact());
    scene.add_body(fixed("wall", Box{{1.0, 1.0, 0.002}}));
    add_missile(scene, {0.01, 0.02, 0.3}, {1.0, 0.5, -speed});
    EXPECT_EQ(cut_steps(scene, pack(scene), 30), 1) << speed;
    const Audit found = audit(scene, pack(scene), 30 * step);
    const double parting = 0.5 * 0.5 * 1e-3 * 1e-3;  // of the 1 mm/s at which overlap is put right
    EXPECT_NEAR(found.contacts, -0.5 * 0.5 * speed * speed, 1.01 * parting + 1e-9 * speed * speed);
    EXPECT_LT(found.friction, -0.01);
    EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover());
  }
}

// Of a rod that turns so fast [rad/s] and hits a ball.
Audit audit_of_hit(double turning) {
  Scene scene = rod_on_post(Vector3::UnitY());
  scene.add_body(body("object", Sphere{0.02}, 0.1, {0.35, 0.0, -0.2}, Role::object, 0.8));
  const State state = pack(scene, {}, {{"hinge", {0.0, turning}}});
  EXPECT_GT(cut_steps(scene, state, 30), 0) << turning;
  return audit(scene, state, 30 * step);
}

TEST(Audit, FastLinkThatHitsABallLosesEnergyInContactsAndFriction) {
  const Audit found = audit_of_hit(20.0);
  EXPECT_LT(found.contacts, -0.5);
  EXPECT_LT(found.friction, -0.01);
  EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover());
}

// Their first try ends in an impact too, and is undone.
TEST(Audit, PartsOfAStepThatAreTriedAgainCountOnce) {
  for (const double turning : {60.0, 100.0}) {
    const Audit found = audit_of_hit(turning);
    EXPECT_LT(found.energy_change, 0.0) << turning;
    EXPECT_LT(found.contacts, -0.5) << turning;
    EXPECT_NEAR(found.leftover(), 0.0, 1e-12 * found.turnover()) << turning;
  }
}

// Four balls in a room with thin walls.
Scene billiards() {
  Scene scene;
  scene.add_body(fixed("ground", Plane{}));
  scene.add_body(fixed("left wall", Box{{0.002, 1.0, 1.0}}, {-0.15, 0.0, 0.5}));
  scene.add_body(fixed("right wall", Box{{0.002, 1.0, 1.0}}, {0.15, 0.0, 0.5}));
  for (int i = 0; i < 4; ++i) {
    scene.add_body(body("ball " + std::to_string(i), Sphere{0.03}, 0.1, {-0.1 + 0.07 * i, 0.01 * i, 0.1 + 0.02 * i},
                        i == 0 ? Role::object : Role::none, 0.8));
  }
  return scene;
}

TEST(Audit, LeftoverOfFastBallsBetweenThinWallsIsRounding) {
  std::mt19937_64 random(1);
  const Scene scene = billiards();
  int cut = 0, unconverged = 0;
  for (int i = 0; i < 40; ++i) {
    const State state = hurled(scene, pack(scene), random);
    cut += cut_steps(scene, state, 24);
    const Rollout rollout = World(scene).rollout(state, {Wrench{}}, 24 * step, true);
    EXPECT_LT(rollout.audit->energy_change, 0.0) << i;
    if (rollout.unconverged > 0) {
      ++unconverged;
      continue;
    }
    EXPECT_NEAR(rollout.audit->leftover(), 0.0, 1e-12 * rollout.audit->turnover()) << i;
  }
  EXPECT_GT(cut, 40);
  EXPECT_LE(unconverged, 2);
}

// What is left over is that of turning in steps: 0.1 % in the median, as where no step is cut.
TEST(Audit, LeftoverOfFastMechanismsIsSmall) {
  std::vector<double> shares;
  int cut = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    std::mt19937_64 random(seed);
    const Scene scene = random_mechanisms(seed);
    const State state = hurled(scene, pack(scene), random, 10.0, 10.0);
    cut += cut_steps(scene, state, 24);
    const Disturbance none(scene.with_role(Role::object).size());
    const Audit found = *World(scene).rollout(state, {none}, 24 * step, true).audit;
    shares.push_back(std::abs(found.leftover()) / found.turnover());
  }
  std::sort(shares.begin(), shares.end());
  EXPECT_GT(cut, 40);
  EXPECT_LT(shares[shares.size() / 2], 0.005);
  EXPECT_LT(shares[shares.size() * 8 / 10], 0.03);
}

// ---- manipulation, with the solver's own settings: the bounds of docs/engineering/energy_audit.md

void expect_small_leftover(const Audit& found, double share) {
  EXPECT_GT(found.turnover(), 0.01);
  EXPECT_LT(std::abs(found.leftover()), share * found.turnover());
}

TEST(Audit, LeftoverOfAPlanarPushIsRounding) {
  const Scene scene = push_scene();
  expect_small_leftover(audit(scene, pack(scene), 0.5, {{0.8, 0.3, 0.0}, {0.0, 0.0, 0.05}}), 1e-9);
}

TEST(Audit, LeftoverOfABoxThatSlidesOnABoxIsRounding) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("lower", Box{{0.3, 0.3, 0.1}}, 2.0, {0.0, 0.0, 0.05}));
  Body upper = body("object", Box{{0.1, 0.1, 0.1}}, 0.5, {0.0, 0.0, 0.15}, Role::object);
  upper.state.velocity = {0.6, 0.0, 0.0};
  scene.add_body(upper);
  expect_small_leftover(audit(scene, pack(scene), 0.5, {{0.3, 0.2, 0.0}, Vector3::Zero()}), 1e-9);
}

TEST(Audit, LeftoverOfAGraspIsSmall) {
  const Scene scene = hand(1.0, true);
  expect_small_leftover(audit(scene, pack(scene), 0.3, {{0.8, 0.5, -0.5}, {0.01, 0.02, 0.0}}), 1e-3);
}

TEST(Audit, LeftoverOfACompoundOfHullsThatTumblesOntoATableIsSmall) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  const Compound hammer{
      {{brick({0.2, 0.03, 0.03}), Pose{}}, {Box{{0.04, 0.12, 0.04}}, {{0.1, 0.0, 0.0}, Quaternion::Identity()}}}};
  Body thrown = body("object", hammer, 0.4, {0.0, 0.0, 0.3}, Role::object);
  thrown.state.velocity = {0.5, 0.2, 0.0};
  thrown.state.angular_velocity = {2.0, 5.0, 1.0};
  scene.add_body(thrown);
  expect_small_leftover(audit(scene, pack(scene), 1.0), 1e-3);
}

}  // namespace
}  // namespace energymargin

// Mechanical energy, term by term, and its balance.

#include <gtest/gtest.h>

#include <cmath>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

double energy_at(const Scene& scene, double position, double velocity = 0.0) {
  return World(scene).energy(pack(scene, {}, {{"hinge", {position, velocity}}}));
}

Joint compliant(double torque_limit = infinity) {
  Joint made;
  made.stiffness = 8.0;
  made.damping = 3.0;
  made.target = 0.5;
  made.torque_limit = torque_limit;
  return made;
}

TEST(Energy, LinksCountWithTheirMotionAndHeight) {
  const Scene turning = rod_on_post(Vector3::UnitZ());
  EXPECT_NEAR(energy_at(turning, 0.3, 2.0), 0.5 * rod_inertia * 4.0, 1e-15);
  const Scene hanging = rod_on_post(Vector3::UnitY(), downwards);
  EXPECT_NEAR(energy_at(hanging, 0.3), -0.3 * g * 0.25 * std::sin(0.3), 1e-15);
}

TEST(Energy, ArmatureCountsWithTheSpeedOfItsJoint) {
  Joint geared;
  geared.armature = 0.25;
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), geared);
  EXPECT_NEAR(energy_at(scene, 0.3, 2.0), 0.5 * (rod_inertia + 0.25) * 4.0, 1e-15);
}

TEST(Energy, ComplianceIsThatOfASpringAboutTheTarget) {
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), compliant());
  EXPECT_NEAR(energy_at(scene, 0.5), 0.0, 1e-15);
  EXPECT_NEAR(energy_at(scene, 0.8), 0.5 * 8.0 * 0.09, 1e-15);
  EXPECT_NEAR(energy_at(scene, -0.5), 0.5 * 8.0, 1e-15);
}

TEST(Energy, ComplianceBeyondTheTorqueLimitGrowsWithTheLimitAlone) {
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), compliant(1.6));  // reached 0.2 rad from target
  EXPECT_NEAR(energy_at(scene, 0.6), 0.5 * 8.0 * 0.01, 1e-15);
  EXPECT_NEAR(energy_at(scene, 0.7), 0.5 * 8.0 * 0.04, 1e-15);
  EXPECT_NEAR(energy_at(scene, 1.5), 0.5 * 8.0 * 0.04 + 1.6 * 0.8, 1e-15);
  EXPECT_NEAR(energy_at(scene, -0.5), 0.5 * 8.0 * 0.04 + 1.6 * 0.8, 1e-15);
  Joint held = compliant();
  held.held = true;
  EXPECT_EQ(energy_at(rod_on_post(Vector3::UnitZ(), Vector3::Zero(), held), 1.5), 0.0);
}

TEST(Energy, JointThatPullsBackAtItsTorqueLimitGivesBackWhatItStored) {
  Joint weak = compliant(0.4);
  weak.damping = 0.0;
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), weak);
  const World world(scene);
  const std::vector<State> way = trajectory(scene, pack(scene, {}, {{"hinge", {-1.0, 0.0}}}), 60);
  // Each step of constant torque adds half its square times step over inertia, as any constant force does.
  const double excess = 0.5 * 0.4 * 0.4 * step * step / rod_inertia;
  EXPECT_NEAR(world.energy(way[60]), world.energy(way[0]) - 60.0 * excess, 1e-9);
  EXPECT_GT(way[60][1], 3.0);
}

TEST(Energy, SpringCountsWithItsStretchWhereverItIsFixed) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{}, {0.0, 0.0, 4.0}));
  Body block = body("object", Box{}, 2.0, Vector3::Zero(), Role::object);
  block.state.orientation = turn(0.5 * pi, Vector3::UnitZ());
  scene.add_body(block);
  scene.add_spring({"object", "post", {0.5, 0.0, 0.0}, {0.0, 0.5, -1.0}, 7.0, 1.0, 2.0});
  EXPECT_NEAR(World(scene).energy(pack(scene)), 0.5 * 7.0 * 4.0, 1e-14);
}

TEST(Energy, ConstantForceThatCarriesTheWeightHoldsABodyAtRest) {
  Scene scene(downwards, exact());
  Body balloon = body("object", Box{{0.3, 0.2, 0.1}}, 0.7, {1.0, 2.0, 3.0}, Role::object);
  balloon.force = {0.0, 0.0, 0.7 * g};
  scene.add_body(balloon);
  const State end = World(scene).rollout(pack(scene), {Wrench{}}, 2.0).state;
  EXPECT_LT((end - pack(scene)).norm(), 1e-12);
}

TEST(Energy, ConstantForceCarriesALinkToo) {
  Scene base = rod_on_post(Vector3::UnitY(), downwards);
  Scene scene(downwards, exact());
  for (Body made : base.bodies()) {
    if (made.name == "rod") made.force = {0.0, 0.0, 0.3 * g};
    scene.add_body(made);
  }
  scene.add_joint(base.joints().front());
  EXPECT_LT(after(scene, pack(scene), 480).norm(), 1e-12);
  EXPECT_NEAR(energy_at(scene, 0.7), 0.0, 1e-15);
}

TEST(Energy, FallUnderGravityAndAConstantForceKeepsTheEnergyButForTheStep) {
  Scene scene(downwards, exact());
  Body pulled = body("object", Box{{0.3, 0.2, 0.1}}, 0.7, {1.0, 2.0, 3.0}, Role::object);
  pulled.force = {2.0, -1.0, 0.5};
  pulled.state.velocity = {0.3, 0.1, 4.0};
  scene.add_body(pulled);
  World world(scene);
  const Vector3 force = pulled.force + 0.7 * downwards;
  // Positions move with the velocity at the step's end: half a step too far.
  const double excess = 0.5 * force.squaredNorm() / 0.7 * step;
  EXPECT_NEAR(world.rollout(pack(scene), {Wrench{}}, 1.5).energy, world.energy(pack(scene)) - 1.5 * excess, 1e-9);
}

TEST(Energy, WorkOnAFreeObjectIsTheGainOfASceneWithSpringsAndJointsItDoesNotTouch) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("ceiling", Box{{0.1, 0.1, 0.1}}, {5.0, 0.0, 2.0}));
  scene.add_body(body("weight", Sphere{0.1}, 1.5, {5.0, 0.0, 1.7 - 1.5 * g / 40.0}));
  scene.add_spring({"ceiling", "weight", Vector3::Zero(), Vector3::Zero(), 40.0, 0.3, 0.0});
  scene.add_body(body("hanging", Box{{0.1, 0.1, 0.4}}, 0.4, Vector3::Zero()));
  Joint hinge =
      joint("hinge", JointType::revolute, "ceiling", "hanging", Vector3::UnitX(), {0.0, 1.0, 0.0}, {0.0, 0.0, 0.2});
  hinge.stiffness = 4.0;
  scene.add_joint(hinge);
  Body balloon = body("object", Box{{0.3, 0.2, 0.1}}, 0.7, Vector3::Zero(), Role::object);
  balloon.force = {0.0, 0.0, 0.7 * g};
  scene.add_body(balloon);
  Wrench wrench;
  wrench.force = {1.0, -0.5, 0.3};
  World world(scene);
  const Rollout rollout = world.rollout(pack(scene), {wrench}, 1.0);
  EXPECT_NEAR(rollout.work, 0.5 * wrench.force.squaredNorm() / 0.7, 1e-9);
  EXPECT_NEAR(rollout.energy - world.energy(pack(scene)), rollout.work, 1e-9);
}

TEST(Energy, WorkOnAnObjectOnASpringIsTheGainOfTheirEnergy) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("object", Sphere{0.1}, 1.5, {1.0, 0.0, 0.0}, Role::object));
  scene.add_spring({"post", "object", Vector3::Zero(), Vector3::Zero(), 40.0, 1.0, 0.0});
  Wrench wrench;
  wrench.force = {2.0, 0.0, 0.0};
  World world(scene);
  const double most = 2.0 * 2.0 * 2.0 / 40.0;  // at the far end of the swing
  for (const double duration : {0.2, 0.3, 0.6, 2.0}) {
    const Rollout rollout = world.rollout(pack(scene), {wrench}, duration);
    EXPECT_NEAR(rollout.energy - world.energy(pack(scene)), rollout.work, 0.02 * most) << duration;
  }
}

}  // namespace
}  // namespace energymargin

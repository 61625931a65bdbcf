// Where an object may be.

#include "physics/free_space.hpp"

#include <gtest/gtest.h>

#include <random>

#include "energymargin/world.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double far_away = 10.0;

Pose at(const Vector3& position, const Quaternion& orientation = Quaternion::Identity()) {
  return {position, orientation};
}

FreeSpace free_space(const Scene& scene) { return {scene, pack(scene), scene.index("object")}; }

// A ball above a table, next to a wall whose face is at x = 0.5.
Scene ball_at_a_wall(double height = 0.3) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(fixed("wall", Box{{0.2, 2.0, 2.0}}, {0.6, 0.0, 1.0}));
  scene.add_body(body("object", Sphere{0.1}, 1.0, {0.0, 0.0, height}, Role::object));
  return scene;
}

TEST(FreeSpace, ClearanceIsTheDistanceToTheNearestBody) {
  FreeSpace space = free_space(ball_at_a_wall());
  const double more = space.tolerance();
  EXPECT_NEAR(space.clearance(at({0.0, 0.0, 0.3}), far_away), 0.2 + more, 1e-9);
  EXPECT_NEAR(space.clearance(at({0.35, 0.0, 0.3}), far_away), 0.05 + more, 1e-6);
  EXPECT_NEAR(space.clearance(at({0.6, 0.0, 2.4}), far_away), 0.3 + more, 1e-6);
}

TEST(FreeSpace, ClearanceIsNotLookedForBeyondItsReach) {
  FreeSpace space = free_space(ball_at_a_wall());
  EXPECT_EQ(space.clearance(at({0.0, 0.0, 5.0}), 0.25), 0.25);
}

TEST(FreeSpace, PenetrationIsNotFree) {
  FreeSpace space = free_space(ball_at_a_wall());
  EXPECT_LT(space.clearance(at({0.0, 0.0, 0.099}), far_away), 0.0);
  EXPECT_LT(space.clearance(at({0.41, 0.0, 0.5}), far_away), 0.0);
  EXPECT_LT(space.clearance(at({0.6, 0.0, 0.5}), far_away), 0.0) << "in the middle of the wall";
  EXPECT_LT(space.clearance(at({0.0, 0.0, -3.0}), far_away), 0.0) << "deep in the ground";
}

TEST(FreeSpace, WhatTouchesIsFree) {
  FreeSpace space = free_space(ball_at_a_wall(0.1));
  EXPECT_GE(space.clearance(at({0.0, 0.0, 0.1}), 0.0), 0.0);
  EXPECT_GE(space.clearance(at({0.4, 0.0, 0.1}), 0.0), 0.0);
}

TEST(FreeSpace, ObjectMayBeAsDeepInABodyAsAtTheStartAndInAnotherItMayNot) {
  const double depth = 0.01;
  FreeSpace space = free_space(ball_at_a_wall(0.1 - depth));
  EXPECT_GE(space.clearance(at({0.2, 0.0, 0.1 - depth}), 0.0), 0.0);
  EXPECT_LT(space.clearance(at({0.2, 0.0, 0.1 - depth - 2.0 * space.tolerance()}), 0.0), 0.0);
  EXPECT_LT(space.clearance(at({0.4 + depth, 0.0, 0.3}), 0.0), 0.0);
}

TEST(FreeSpace, ClearanceOfTurnedSolidsIsThatOfTheWorld) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Shape& shape :
       std::vector<Shape>{Box{{0.3, 0.2, 0.1}}, Cylinder{0.1, 0.3}, Capsule{0.1, 0.2}, brick({0.3, 0.2, 0.1}),
                          Compound{{{Box{{0.3, 0.1, 0.1}}, {{0.2, 0.0, 0.0}, turn(0.5, Vector3::UnitZ())}},
                                    {Sphere{0.1}, {{-0.1, 0.1, 0.0}, Quaternion::Identity()}}}}}) {
    Scene scene;
    scene.add_body(fixed("block", Box{{0.4, 0.5, 0.6}}));
    scene.add_body(body("object", shape, 1.0, {0.0, 0.0, 2.0}, Role::object));
    FreeSpace space = free_space(scene);
    World world(scene);
    for (int i = 0; i < 50; ++i) {
      BodyState state;
      state.position = {uniform(random), uniform(random), uniform(random)};
      state.orientation = Quaternion(uniform(random), uniform(random), uniform(random), uniform(random)).normalized();
      const double distance = world.distance(pack(scene, {{"object", state}}), "object", "block");
      const double clearance = space.clearance(at(state.position, state.orientation), far_away);
      if (distance > 0.0) {
        EXPECT_NEAR(clearance, distance + space.tolerance(), 1e-6) << "shape " << shape.index();
      } else if (distance < -2.0 * space.tolerance()) {
        EXPECT_LT(clearance, 0.0) << "shape " << shape.index();
      }
    }
  }
}

TEST(FreeSpace, BodiesThatNeverCollideAreNotInTheWay) {
  Scene scene = ball_at_a_wall();
  scene.disable_collisions("object", "wall");
  EXPECT_GT(free_space(scene).clearance(at({0.6, 0.0, 0.5}), far_away), 0.0);
}

TEST(FreeSpace, OtherBodiesAreWhereTheStateSaysThatTheyAre) {
  Scene scene;
  scene.add_body(body("finger", Box{{0.1, 0.1, 0.1}}, 1.0, {1.0, 0.0, 0.0}, Role::effector));
  scene.add_body(body("object", Sphere{0.1}, 1.0, {0.0, 0.0, 0.0}, Role::object));
  BodyState finger;
  finger.position = {0.0, 2.0, 0.0};
  FreeSpace space(scene, pack(scene, {{"finger", finger}}), scene.index("object"));
  EXPECT_GT(space.clearance(at({1.0, 0.0, 0.0}), far_away), 0.5);
  EXPECT_LT(space.clearance(at({0.0, 2.0, 0.0}), far_away), 0.0);
}

}  // namespace
}  // namespace energymargin

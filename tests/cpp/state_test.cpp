// The layout of a state vector.

#include "energymargin/state.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

BodyState somewhere() {
  return {{1.0, 2.0, 3.0}, turn(0.5, Vector3(1.0, 2.0, 3.0).normalized()), {4.0, 5.0, 6.0}, {7.0, 8.0, 9.0}};
}

TEST(State, MovingBodiesHaveThirteenNumbersEachInTheOrderOfTheScene) {
  const Scene scene = push_scene();
  const StateLayout layout(scene);
  EXPECT_EQ(layout.dimension(), 26);
  EXPECT_EQ(layout.offset(0), -1);
  EXPECT_EQ(layout.offset(1), 0);
  EXPECT_EQ(layout.offset(2), 13);
}

TEST(State, NumbersArePositionQuaternionXyzwVelocityAngularVelocity) {
  const BodyState given = somewhere();
  const State state = pack(push_scene(), {{"effector", given}});
  Eigen::Matrix<double, 13, 1> expected;
  expected << 1.0, 2.0, 3.0, given.orientation.x(), given.orientation.y(), given.orientation.z(), given.orientation.w(),
      4.0, 5.0, 6.0, 7.0, 8.0, 9.0;
  EXPECT_EQ(state.tail<13>(), expected);
}

TEST(State, UnpackGivesBackWhatPackWasGivenAndTheScenesOwnForTheRest) {
  const Scene scene = push_scene();
  const State state = pack(scene, {{"object", somewhere()}});
  const std::map<std::string, BodyState> bodies = unpack(scene, state);
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies.at("object").orientation.coeffs(), somewhere().orientation.coeffs());
  EXPECT_EQ(bodies.at("effector").velocity, Vector3(0.0, 0.4, 0.0));
  EXPECT_TRUE(same_bits(pack(scene, bodies), state));
}

TEST(State, StateOfAnotherSizeIsRejectedWithBothSizes) {
  EXPECT_TRUE(rejects([] { validate(push_scene(), State::Zero(25)); }, {"state", "25", "26"}));
  EXPECT_TRUE(rejects([] { unpack(push_scene(), State::Zero(27)); }, {"state", "27", "26"}));
}

TEST(State, NanAndBadQuaternionAreRejectedByBodyAndQuantity) {
  const Scene scene = push_scene();
  const auto with = [&](int number, double value) {
    return [=] {
      State state = pack(scene);
      state[number] = value;
      validate(scene, state);
    };
  };
  EXPECT_TRUE(rejects(with(13, nan), {"state", "'effector'", "position", "nan", "finite"}));
  EXPECT_TRUE(rejects(with(9, infinity), {"state", "'object'", "velocity", "inf"}));
  EXPECT_TRUE(rejects(with(12, nan), {"state", "'object'", "angular_velocity", "nan"}));
  EXPECT_TRUE(rejects(with(6, 1.1), {"state", "'object'", "orientation", "1.1", "unit quaternion"}));
  EXPECT_TRUE(rejects(with(3, nan), {"state", "'object'", "orientation", "nan"}));
}

TEST(State, VelocityAlongALockedAxisIsRejected) {
  Scene scene;
  Body slider = body("slider", Box{}, 1.0, Vector3::Zero(), Role::object);
  slider.linear_factor.z() = 0.0;
  slider.angular_factor.x() = 0.0;
  scene.add_body(slider);
  BodyState falling;
  falling.velocity.z() = -1.0;
  EXPECT_TRUE(rejects([&] { pack(scene, {{"slider", falling}}); }, {"slider", "velocity", "-1", "locked"}));
  BodyState tipping;
  tipping.angular_velocity.x() = 2.0;
  EXPECT_TRUE(rejects([&] { pack(scene, {{"slider", tipping}}); }, {"slider", "angular_velocity", "2", "locked"}));
}

TEST(State, FixedAndUnknownBodiesCannotBePacked) {
  EXPECT_TRUE(rejects([] { pack(push_scene(), {{"table", {}}}); }, {"'table'", "fixed"}));
  EXPECT_TRUE(rejects([] { pack(push_scene(), {{"cup", {}}}); }, {"'cup'", "'effector'"}));
}

}  // namespace
}  // namespace energymargin

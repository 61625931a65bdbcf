// The layout of a state vector.

#include "energymargin/state.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

BodyState somewhere() {
  return {{1.0, 2.0, 3.0}, turn(0.5, Vector3(1.0, 2.0, 3.0).normalized()), {4.0, 5.0, 6.0}, {7.0, 8.0, 9.0}};
}

// A free base with an arm on a held slide, a hand welded to the arm, and a tip on a hinge; the object apart.
Scene jointed_pair() {
  Scene scene(Vector3::Zero());
  scene.add_body(body("base", Box{{0.3, 0.2, 0.1}}, 1.2, {0.1, 0.2, 0.3}));
  scene.add_body(body("arm", Box{{0.1, 0.1, 0.4}}, 0.7, Vector3::Zero()));
  scene.add_body(body("hand", Box{{0.1, 0.1, 0.1}}, 0.2, Vector3::Zero()));
  scene.add_body(body("tip", Box{{0.1, 0.1, 0.1}}, 0.2, Vector3::Zero()));
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  Joint slide = joint("slide", JointType::prismatic, "base", "arm", Vector3::UnitX());
  slide.held = true;
  slide.state.position = 0.05;
  scene.add_joint(slide);
  scene.add_joint(joint("weld", JointType::fixed, "arm", "hand", Vector3::UnitX(), {0.0, 0.0, 0.25}));
  Joint hinge = joint("hinge", JointType::revolute, "hand", "tip", Vector3::UnitY(), {0.0, 0.0, 0.1});
  hinge.lower = -0.5;
  hinge.upper = 1.0;
  scene.add_joint(hinge);
  return scene;
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
  const std::map<std::string, BodyState> bodies = unpack(scene, state).bodies;
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

// ---- joints

TEST(State, JointsFollowTheBodiesWithTwoNumbersEachAndLinksAndFixedJointsHaveNone) {
  const Scene scene = jointed_pair();
  const StateLayout layout(scene);
  EXPECT_EQ(layout.dimension(), 13 + 13 + 2 + 2);
  EXPECT_EQ(layout.offset(scene.index("base")), 0);
  EXPECT_EQ(layout.offset(scene.index("arm")), -1);
  EXPECT_EQ(layout.offset(scene.index("hand")), -1);
  EXPECT_EQ(layout.offset(scene.index("object")), 13);
  EXPECT_EQ(layout.joint_offset(scene.joint_index("slide")), 26);
  EXPECT_EQ(layout.joint_offset(scene.joint_index("weld")), -1);
  EXPECT_EQ(layout.joint_offset(scene.joint_index("hinge")), 28);
  const State state = pack(scene, {}, {{"hinge", {0.1, 0.2}}, {"slide", {0.3, 0.0}}});
  EXPECT_EQ(state.tail<4>(), Eigen::Vector4d(0.3, 0.0, 0.1, 0.2));
}

TEST(State, UnpackGivesBackEveryJointByNameAndEveryLinkAsABody) {
  const Scene scene = jointed_pair();
  const State state = pack(scene, {{"base", somewhere()}}, {{"hinge", {1.0 / 3.0, -2.0 / 7.0}}});
  const Unpacked unpacked = unpack(scene, state);
  ASSERT_EQ(unpacked.joints.size(), 2u);
  EXPECT_TRUE(same_bits(unpacked.joints.at("hinge").position, 1.0 / 3.0));
  EXPECT_TRUE(same_bits(unpacked.joints.at("hinge").velocity, -2.0 / 7.0));
  EXPECT_EQ(unpacked.joints.at("slide").position, 0.05);
  EXPECT_EQ(unpacked.bodies.size(), 5u);
  EXPECT_EQ(unpacked.bodies.count("arm"), 1u);
  EXPECT_EQ(unpacked.bodies.count("hand"), 1u);
  const std::map<std::string, BodyState> free{{"base", unpacked.bodies.at("base")},
                                              {"object", unpacked.bodies.at("object")}};
  EXPECT_TRUE(same_bits(pack(scene, free, unpacked.joints), state));
}

TEST(State, LinksAndFixedJointsCannotBePackedAndUnknownJointsListTheNames) {
  const Scene scene = jointed_pair();
  EXPECT_TRUE(rejects([&] { pack(scene, {{"arm", {}}}); }, {"'arm'", "no joint carries", "joints"}));
  EXPECT_TRUE(rejects([&] { pack(scene, {}, {{"weld", {}}}); }, {"'weld'", "fixed"}));
  EXPECT_TRUE(rejects([&] { pack(scene, {}, {{"knee", {}}}); }, {"'knee'", "'slide', 'weld', 'hinge'"}));
}

TEST(State, JointThatIsNotFiniteOrHeldWithVelocityIsRejectedByName) {
  const Scene scene = jointed_pair();
  const auto with = [&](double position, double velocity, const std::string& name = "hinge") {
    return [=] { pack(scene, {}, {{name, {position, velocity}}}); };
  };
  EXPECT_TRUE(rejects(with(nan, 0.0), {"joint 'hinge'", "position is nan", "finite"}));
  EXPECT_TRUE(rejects(with(0.0, infinity), {"joint 'hinge'", "velocity is inf", "finite"}));
  EXPECT_TRUE(rejects(with(0.0, 0.1, "slide"), {"joint 'slide'", "velocity is 0.1", "held"}));
  EXPECT_NO_THROW(with(1.0, -3.0)());
  EXPECT_TRUE(rejects([&] { unpack(scene, pack(scene).head(28)); }, {"28 numbers", "30 numbers", "2 for each joint"}));
}

TEST(State, JointMayBeBeyondItsLimits) {
  const Scene scene = jointed_pair();
  for (const double position : {-40.0, -0.7, 1.2, 40.0}) {
    const State state = pack(scene, {}, {{"hinge", {position, 3.0}}});
    EXPECT_NO_THROW(validate(scene, state));
    EXPECT_EQ(unpack(scene, state).joints.at("hinge").position, position);
  }
}

}  // namespace
}  // namespace energymargin

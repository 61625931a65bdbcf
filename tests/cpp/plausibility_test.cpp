// What is legal and looks wrong, as plain values.

#include "energymargin/plausibility.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A box of 4 cm on a table, `height` above it.
Problem on_table(double mass, double height = 0.0) {
  Scene scene;
  Body table;
  table.name = "table";
  table.shape = Plane{};
  scene.add_body(table);
  scene.add_body(body("box", Box{{0.04, 0.04, 0.04}}, mass, {0.0, 0.0, 0.02 + height}, Role::object));
  Problem problem =
      problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.2, regions::Disc{"box", Vector2::Zero(), 0.1});
  validate(problem);
  return problem;
}

std::vector<std::string> abouts(const std::vector<Warning>& warnings) {
  std::vector<std::string> found;
  for (const Warning& warning : warnings) found.push_back(warning.about);
  return found;
}

TEST(Plausibility, BoxOnATableIsPlausible) { EXPECT_TRUE(implausible(on_table(0.1)).empty()); }

TEST(Plausibility, EachWarningSaysWhatItIsOfAndTheValue) {
  const std::vector<Warning> warnings = implausible(on_table(200.0, 0.05));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0].about, "body 'box': mass");
  EXPECT_EQ(warnings[0].text.rfind("body 'box': mass is 200 kg, ", 0), 0u) << warnings[0].text;
  EXPECT_NE(warnings[1].text.find("0.05 m"), std::string::npos) << warnings[1].text;
}

TEST(Plausibility, TimesForcesAndSetsOfAnotherUnitAreWarnedOf) {
  Problem slip = on_table(0.1);
  slip.captured = regions::Disc{"box", Vector2::Zero(), 0.05};
  slip.force = {990.0 * 0.981, 0.0, 0.0};
  slip.horizon = 60.0;
  EXPECT_TRUE(implausible(slip).empty());
  slip.force = {1010.0 * 0.981, 0.0, 0.0};
  slip.horizon = 61.0;
  slip.captured = regions::Disc{"box", Vector2::Zero(), 0.4};  // ten times the box's reach is 0.35 m
  EXPECT_EQ(abouts(implausible(slip)), (std::vector<std::string>{"horizon", "force", "captured"}));
  slip.captured = slip.captured & regions::Ball{"box", Vector3::Zero(), 0.1};
  EXPECT_EQ(abouts(implausible(slip)), (std::vector<std::string>{"horizon", "force"}));
}

TEST(Plausibility, WarningIsOfTheSameInAllStatesOfAScene) {
  const Problem low = on_table(0.1, 0.05);
  Problem high = low;
  high.state[2] += 0.1;
  EXPECT_NE(implausible(low).front().text, implausible(high).front().text);
  EXPECT_EQ(abouts(implausible(low)), abouts(implausible(high)));
}

TEST(Plausibility, StartOutsideIsWarnedOfUnlessItIsMeant) {
  Problem outside = on_table(0.1);
  outside.captured = regions::Disc{"box", {1.0, 0.0}, 0.1};
  EXPECT_EQ(abouts(implausible(outside)), std::vector<std::string>{"state"});
  EXPECT_TRUE(implausible(outside, true).empty());
}

TEST(Plausibility, JointBeyondItsLimitsIsDoubtedByItsNameTheAmountAndTheLimit) {
  Scene scene = two_boxes_on_a_hinge();
  Joint made = joint("rail", JointType::prismatic, "arm", "tool", Vector3::UnitX());
  made.lower = -0.1;
  scene.add_body(body("tool", Box{{0.1, 0.1, 0.1}}, 0.5, Vector3::Zero()));
  scene.add_joint(made);
  const auto doubts_at = [&](double position) {
    return implausible_joints(scene, pack(scene, {}, {{"rail", {position, 0.0}}}));
  };
  EXPECT_TRUE(doubts_at(5.0).empty());
  EXPECT_TRUE(doubts_at(-0.1 - 0.9 * plausible::stop_length).empty());
  const std::vector<Warning> warnings = doubts_at(-0.25);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].about, "state: joint 'rail': position");
  EXPECT_NE(warnings[0].text.find("is -0.25 m, 0.15 m beyond its lower limit of -0.1 m"), std::string::npos)
      << warnings[0].text;
}

TEST(Plausibility, MassOfABodyWhoseForceHoldsItStandsForAMachine) {
  Scene scene;
  Body heavy = body("heavy", Box{{0.1, 0.1, 0.1}}, 1e5, Vector3::Zero());
  EXPECT_FALSE(heavy.fixed());
  heavy.force = {0.0, 0.0, 1e5 * 9.81};
  scene.add_body(heavy);
  scene.add_body(body("box", Box{{0.1, 0.1, 0.1}}, 1.0, {1.0, 0.0, 0.0}));
  EXPECT_TRUE(implausible(scene).empty());
}

TEST(Plausibility, OverlapThatIsDeeperThanContactsTakeIsWarnedOf) {
  const Problem problem = on_table(0.1);
  World world(problem.scene);
  EXPECT_TRUE(implausible_start(world, problem.state).empty());
  State deep = problem.state;
  deep[2] -= 0.025;
  ASSERT_EQ(implausible_start(world, deep).size(), 1u);
  EXPECT_NE(implausible_start(world, deep).front().text.find("0.025 m"), std::string::npos);
}

TEST(Plausibility, AngleBeyondAFullTurnIsWarnedOfAndOneBeyondAllTurnsIsRefused) {
  EXPECT_FALSE(implausible_angle("yaw", -3.14));
  EXPECT_TRUE(implausible_angle("yaw", -90.0));
  EXPECT_TRUE(rejects([] { implausible_angle("yaw", 1e5); }, {"yaw", "100000", "10000 rad"}));
}

}  // namespace
}  // namespace energymargin

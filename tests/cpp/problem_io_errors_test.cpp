// Problem files that are broken: each is refused by a clear word that names the place.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "expect.hpp"
#include "problem_files.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = nlohmann::ordered_json;

// Reading a problem's file with one place changed.
auto reading(const Problem& problem, const std::string& pointer, const Json& value) {
  return [=] {
    Json json = Json::parse(to_json(problem));
    json[Json::json_pointer(pointer)] = value;
    from_json(json.dump());
  };
}
auto reading(const std::string& pointer, const Json& value) { return reading(push(), pointer, value); }

// Reading a problem's file without one key.
Problem read_without(const Problem& problem, const std::string& pointer, const std::string& key) {
  Json json = Json::parse(to_json(problem));
  json[Json::json_pointer(pointer)].erase(key);
  return from_json(json.dump());
}

// Reading the push's file with other words in it.
auto reading_text(const std::string& old, const std::string& changed) {
  return [=] {
    std::string text = to_json(push());
    from_json(text.replace(text.find(old), old.size(), changed));
  };
}

std::string repeated(const std::string& word, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += word;
  return all;
}

// The push's file with other text for its capture set.
std::string with_captured(const std::string& region) {
  const std::string text = to_json(push());
  return text.substr(0, text.find("\"captured\"")) + "\"captured\": " + region + ", " +
         text.substr(text.find("\"succeeded\""));
}

std::string complements(int depth) {
  return with_captured(repeated("{\"type\": \"not\", \"of\": [", depth) + "1" + repeated("]}", depth));
}

TEST(ProblemIoErrors, FileThatIsNotThereOrAFolderOrEmptyIsRejectedByItsName) {
  const Folder folder;
  EXPECT_THROW(load(folder / "none.json"), FileError);
  EXPECT_THROW(load(folder / ""), FileError);
  for (const char* text : {"", " \n\t\n"}) {
    EXPECT_TRUE(rejects([&] { load(folder.write("p.json", text)); }, {folder / "p.json", "empty"}));
  }
}

TEST(ProblemIoErrors, FileCutOffAnywhereIsRejectedByTheLineOfItsEnd) {
  const Folder folder;
  const std::string text = to_json(push());
  for (std::size_t size = 1; size + 2 < text.size(); size += 41) {
    const std::string cut = text.substr(0, size);
    const auto line = std::to_string(std::count(cut.begin(), cut.end() - 1, '\n') + 1);
    EXPECT_TRUE(rejects([&] { load(folder.write("p.json", cut)); }, {"p.json", "cut off at the end of line " + line}));
  }
}

TEST(ProblemIoErrors, TextThatIsNotJsonIsRejectedByItsLineItsPlaceAndItsWords) {
  EXPECT_TRUE(
      rejects([] { from_json("<robot name='x'>"); }, {"not valid JSON at line 1, column 1: '<robot name='x'>'"}));
  EXPECT_TRUE(rejects([] { from_json(to_json(push()) + "x"); }, {"column 1: 'x'"}));
  EXPECT_TRUE(rejects(reading_text("\"rate\": 5.0", "\"rate\": NaN"),
                      {"not valid JSON at line ", ", column 10, near rate: '\"rate\": NaN,'"}));
  EXPECT_TRUE(rejects(reading_text("\"mass\": 1.0,", "\"mass\": 1.0"), {"near scene.bodies[1].mass", "\"position\""}));
  EXPECT_TRUE(rejects(reading_text("\"table\"", "\"t\xff\""), {"near scene.bodies[0].name"}));
}

TEST(ProblemIoErrors, NumberBeyondAllBoundsIsRejectedByItsPlace) {
  EXPECT_TRUE(rejects(reading_text("\"rate\": 5.0", "\"rate\": 1e999"), {"rate is 1e999", "1.8e308"}));
  EXPECT_TRUE(rejects(reading_text("-9.81", "-1e999"), {"scene.gravity[2] is -1e999"}));
  EXPECT_TRUE(rejects(reading("/scene/solver_iterations", 1e30), {"scene.solver_iterations is 1e+30", "whole number"}));
  EXPECT_TRUE(rejects(reading("/scene/solver_iterations", 10001),
                      {"scene: solver_iterations is 10001", "a whole number from 1 to 10000"}));
  EXPECT_TRUE(rejects(reading("/scene/solver_iterations", 3000000000U), {"scene.solver_iterations", "smaller number"}));
}

TEST(ProblemIoErrors, KeyThatIsGivenTwiceIsRejectedByItsPlace) {
  EXPECT_TRUE(rejects(reading_text("\"mass\": 1.0", "\"mass\": 1.0, \"mass\": 2.0"),
                      {"scene.bodies[1].mass is given twice", "once"}));
  EXPECT_TRUE(rejects(reading_text("\"rate\"", "\"version\": 3, \"rate\""), {"version is given twice"}));
}

TEST(ProblemIoErrors, DeepNestingIsRejectedByItsPlace) {
  EXPECT_TRUE(rejects([] { from_json(complements(70)); }, {"captured.of[0]", "levels"}));
}

TEST(ProblemIoErrors, NestingDeeperThanTheStackIsRejectedAndNotRecursedInto) {
  EXPECT_TRUE(rejects([] { from_json(complements(200000)); }, {"captured.of[0]", "256 levels"}));
  EXPECT_TRUE(rejects([] { from_json(with_captured(repeated("[", 400000) + repeated("]", 400000))); }, {"256 levels"}));
  EXPECT_TRUE(rejects([] { from_json(repeated("{\"a\":", 400000)); }, {"256 levels"}));
}

TEST(ProblemIoErrors, FileOfAnotherFormatOrNewerVersionIsRejected) {
  EXPECT_TRUE(rejects([] { from_json("{}"); }, {"format", "energymargin-problem"}));
  EXPECT_TRUE(rejects([] { from_json("[1, 2]"); }, {"[1,2]", "object"}));
  EXPECT_TRUE(rejects(reading("/format", "urdf"), {"format", "energymargin-problem"}));
  EXPECT_TRUE(rejects(reading("/format", 7), {"format", "7"}));
  EXPECT_TRUE(rejects(reading("/version", 7), {"version is 7", "at most 6", "newer"}));
  EXPECT_TRUE(rejects(reading("/version", 0), {"version is 0", "from 3 to 6"}));
  EXPECT_TRUE(rejects(reading("/version", 2), {"version is 2", "from 3 to 6"}));
  EXPECT_TRUE(rejects(reading("/version", "1"), {"version", "\"1\"", "whole number"}));
}

TEST(ProblemIoErrors, MisspeltAndMissingKeysAreRejectedByTheirPlace) {
  EXPECT_TRUE(rejects(reading("/durration", 0.5), {"unknown \"durration\"", "duration"}));
  EXPECT_TRUE(rejects(reading("/scene/gravitiy", 0), {"scene has an unknown \"gravitiy\"", "gravity"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/frictoin", 0), {"scene.bodies[1]", "\"frictoin\"", "friction"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/shape/radius", 1), {"scene.bodies[1].shape", "\"radius\"", "size"}));
  EXPECT_TRUE(rejects(reading("/captured/raduis", 1), {"captured", "\"raduis\"", "radius"}));
  Json json = Json::parse(to_json(push()));
  json["scene"]["bodies"][2].erase("mass");
  EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene.bodies[2]", "no \"mass\""}));
}

TEST(ProblemIoErrors, ValueOfAnotherTypeIsRejectedByItsPlace) {
  EXPECT_TRUE(rejects(reading("/rate", "NaN"), {"rate", "\"NaN\"", "a number"}));
  EXPECT_TRUE(rejects(reading("/rate", nullptr), {"rate", "null", "a number"}));
  EXPECT_TRUE(rejects(reading("/state/3", "NaN"), {"state[3]", "\"NaN\"", "a number"}));
  EXPECT_TRUE(rejects(reading("/force", Json::array({1, 2})), {"force", "[1,2]", "3 numbers"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/mass", "1 kg"), {"scene.bodies[1].mass", "1 kg", "a number"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/role", "tool"), {"scene.bodies[1].role", "tool", "\"effector\""}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/shape/type", "cone"), {"scene.bodies[1].shape.type", "cone", "box"}));
  EXPECT_TRUE(rejects(reading("/scene/solver_iterations", 1.5), {"scene.solver_iterations", "1.5", "whole"}));
  EXPECT_TRUE(rejects(reading("/captured", Json::array()), {"captured", "[]", "object"}));
  EXPECT_TRUE(rejects(reading("/captured/type", "cone"), {"captured.type", "cone", "\"disc\""}));
}

TEST(ProblemIoErrors, LongValueIsCutBetweenTwoOfItsCharacters) {
  const std::string accents = repeated("\xc3\xa9", 100);
  EXPECT_TRUE(rejects(reading("/rate", accents), {"rate is \"\xc3\xa9", "\xc3\xa9..., expected a number"}));
}

TEST(ProblemIoErrors, ValuesThatThePhysicsForbidsAreRejectedByTheirPlace) {
  EXPECT_TRUE(
      rejects(reading("/scene/bodies/1/mass", -1), {"scene.bodies[1]", "'object'", "mass is -1", "at least 0"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/orientation/3", 0.5), {"scene.bodies[1]", "'object'", "unit"}));
  EXPECT_TRUE(rejects(reading("/scene/step", 0), {"scene", "step is 0", "above 0"}));
  EXPECT_TRUE(rejects(reading("/state/6", 0.5), {"state", "'object'", "orientation", "0.5", "unit"}));
  EXPECT_TRUE(rejects(reading("/state", Json::array({1, 2, 3})), {"state", "3 numbers", "26"}));
  EXPECT_TRUE(rejects(reading("/captured/radius", 0), {"captured", "radius is 0", "above 0"}));
  EXPECT_TRUE(rejects(reading("/duration", 0), {"duration is 0", "one step"}));
  const Json inertial = {{"center", {0, 0, 0}}, {"moments", {1, 1, 3}}, {"axes", {0, 0, 0, 1}}};
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/inertial", inertial),
                      {"scene.bodies[1]", "moments is (1, 1, 3)", "none is greater than the sum of the others"}));
}

TEST(ProblemIoErrors, BodyThatIsNotThereIsRejectedByThePlaceThatNamesIt) {
  const auto everywhere = [](const std::string& pointer) { return reading(everything(), pointer, "cup"); };
  for (const auto& [pointer, place] : std::vector<std::pair<std::string, std::string>>{
           {"/captured/of/0/of/1/body", "captured.of[0].of[1].body"},
           {"/captured/of/0/of/0/frame", "captured.of[0].of[0].frame"},
           {"/succeeded_any/of/0/body", "succeeded_any.of[0].body"},
           {"/within/of/1/by", "within.of[1].by"},
           {"/contacts/0/body_b", "contacts[0].body_b"},
           {"/scene/springs/0/body_a", "scene.springs[0].body_a"},
           {"/scene/disabled_collisions/1/0", "scene.disabled_collisions[1][0]"},
           {"/scene/pair_frictions/1/body_b", "scene.pair_frictions[1].body_b"}}) {
    EXPECT_TRUE(rejects(everywhere(pointer), {place + " is \"cup\"", "one of the bodies 'plane', 'body 0'"}));
  }
  EXPECT_TRUE(rejects(reading("/captured/frame", ""), {"captured.frame is \"\"", "'object'"}));
}

TEST(ProblemIoErrors, JointsAndSpringsThatCannotBeAreRejectedByTheirPlace) {
  const auto reading_hand = [](const std::string& pointer, const Json& value) {
    return reading(articulated(), pointer, value);
  };
  const Json follows_twin = {{"joint", "twin"}, {"multiplier", 1}, {"offset", 0}};
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/0/type", "ball"), {"scene.joints[0].type", "ball", "\"revolute\""}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/0/parent", "cup"), {"scene.joints[0].parent", "cup", "'palm'"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/lower", 5.0), {"scene.joints[1]", "lower limit is 5"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/uper", 5.0), {"scene.joints[1]", "\"uper\"", "upper"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/held", "no"), {"scene.joints[1].held", "\"no\"", "true or false"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/12/mimic/joint", "twin"), {"scene.joints[12]", "'twin'"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/12/mimic/joint", "weld"), {"scene.joints[12]", "'weld'", "moves"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/12/mimic/multiplier", 0), {"scene.joints[12]", "multiplier is 0"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/springs/0/stiffness", 1e9), {"scene.springs[0]", "stiffness is 1e+09"}));
  EXPECT_TRUE(rejects(reading_hand("/force_weights/enage", 1), {"force_weights", "\"enage\"", "engage"}));
}

// Reading a plan of one number a row with another text for its rows.
auto reading_rows(const std::string& rows) { return reading(planned(), "/plan/targets/0/rows", rows); }

TEST(ProblemIoErrors, ClockInAFileOfAnOlderVersionIsRejected) {
  for (const char* key : {"horizon", "check", "dwell", "plan"}) {
    Json json = Json::parse(to_json(planned()));
    for (const char* other : {"horizon", "check", "dwell", "plan"}) {
      if (std::string(other) != key) json.erase(other);
    }
    for (const char* part : {"tendons", "loops"}) json["scene"].erase(part);
    json["version"] = 3;
    EXPECT_TRUE(rejects([&] { from_json(json.dump()); },
                        {"problem has \"" + std::string(key) + "\"", "\"version\": 4", "says 3"}));
  }
}

TEST(ProblemIoErrors, FrictionRuleInAFileOfAnOlderVersionIsRejected) {
  for (const auto& [key, other] : {std::pair{"friction_rule", "pair_frictions"}, {"pair_frictions", "friction_rule"}}) {
    Json json = Json::parse(to_json(everything()));
    json["scene"].erase(other);
    json["scene"]["bodies"][4].erase("kinematic");
    json["version"] = 4;
    EXPECT_TRUE(rejects([&] { from_json(json.dump()); },
                        {"scene has \"" + std::string(key) + "\"", "\"version\": 5", "says 4"}));
  }
}

TEST(ProblemIoErrors, KinematicBodyInAFileOfAnOlderVersionIsRejectedByItsPlace) {
  Json json = Json::parse(to_json(everything()));
  json["scene"].erase("friction_rule");
  json["scene"].erase("pair_frictions");
  json["version"] = 3;
  EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene.bodies[4] has \"kinematic\"", "\"version\": 5"}));
}

TEST(ProblemIoErrors, ArmatureInAFileOfAnOlderVersionIsRejectedByItsPlace) {
  Json json = Json::parse(to_json(everything()));
  json["scene"].erase("friction_rule");
  json["scene"].erase("pair_frictions");
  json["scene"]["bodies"][4].erase("kinematic");
  json["version"] = 4;
  EXPECT_TRUE(
      rejects([&] { from_json(json.dump()); }, {"scene.joints[0] has \"armature\"", "\"version\": 5", "says 4"}));
  json["scene"]["joints"][0].erase("armature");
  EXPECT_EQ(from_json(json.dump()).scene.joints().front().armature, 0.0);
}

TEST(ProblemIoErrors, FrictionRulesAndFrictionOfPairsThatCannotBeAreRejectedByTheirPlace) {
  const auto reading_scene = [](const std::string& place, const Json& value) {
    return reading(everything(), "/scene/" + place, value);
  };
  EXPECT_TRUE(rejects(reading_scene("friction_rule", "min"),
                      {"scene.friction_rule is \"min\"", "one of \"product\", \"max\""}));
  EXPECT_TRUE(rejects(reading_scene("pair_frictions/0/friction", -1.0), {"scene.pair_frictions[0]", "friction is -1"}));
  EXPECT_TRUE(rejects(reading_scene("pair_frictions/0/body_b", "plane"), {"pair_frictions[0]", "another body"}));
  EXPECT_TRUE(rejects(reading_scene("pair_frictions/0/body", "plane"), {"pair_frictions[0] has an unknown \"body\""}));
}

TEST(ProblemIoErrors, HorizonCheckAndDwellThatCannotBeAreRejected) {
  const Problem problem = planned();
  EXPECT_TRUE(rejects(reading(problem, "/horizon", 0), {"horizon is 0", "whole steps"}));
  EXPECT_TRUE(rejects(reading(problem, "/horizon", nullptr), {"horizon is null", "a number"}));
  EXPECT_TRUE(rejects(reading(problem, "/horizon", 1e300), {"horizon is 1e+300", "at most"}));
  EXPECT_TRUE(rejects(reading(problem, "/horizon", 5.0), {"plan is ", "as long as the horizon, 5 s"}));
  EXPECT_TRUE(rejects(reading(problem, "/check", "often"), {"check is \"often\"", "a number"}));
  EXPECT_TRUE(rejects(reading(problem, "/check", -1.0), {"check is -1", "whole steps"}));
  EXPECT_TRUE(rejects(reading(problem, "/dwell", -1.0), {"dwell is -1", "whole steps"}));
  EXPECT_TRUE(rejects(reading(problem, "/effector", "drive"), {"effector is \"drive\" with a plan", "coast"}));
}

TEST(ProblemIoErrors, PlansThatCannotBeAreRejectedByTheirPlace) {
  const auto reading_plan = [](const std::string& pointer, const Json& value) {
    return reading(planned(), "/plan" + pointer, value);
  };
  EXPECT_TRUE(rejects(reading_plan("", 3), {"plan is 3", "an object"}));
  EXPECT_TRUE(rejects(reading_plan("", Json{{"step", 1.0}}), {"plan is empty", "at least one row"}));
  EXPECT_TRUE(rejects(reading_plan("/stepp", 3), {"plan has an unknown \"stepp\"", "step, wrenches"}));
  EXPECT_TRUE(rejects(reading_plan("/step", 0.001), {"plan: step of the plan is 0.001", "at least a step"}));
  EXPECT_TRUE(rejects(reading_plan("/step", 1e300), {"plan is 7e+300 s", "at most 1000000 steps"}));
  EXPECT_TRUE(rejects(reading_plan("/wrenches", "none"), {"plan.wrenches is \"none\"", "a list"}));
  EXPECT_TRUE(rejects(reading_plan("/wrenches/0/body", "cup"), {"plan.wrenches[0].body is \"cup\"", "'palm'"}));
  EXPECT_TRUE(rejects(reading_plan("/wrenches/0/body", "palm"), {"plan: wrenches['palm'] is on a fixed body"}));
  EXPECT_TRUE(rejects(reading_plan("/wrenches/0/body", "pusher"), {"plan: wrenches['pusher'] is there twice"}));
  EXPECT_TRUE(rejects(reading_plan("/wrenches/0/force", 1.0), {"plan.wrenches[0] has an unknown \"force\""}));
  EXPECT_TRUE(rejects(reading_plan("/targets/1/joint", "hip"), {"plan.targets[1].joint is \"hip\"", "'left 1'"}));
  EXPECT_TRUE(rejects(reading_plan("/targets/1/joint", "weld"), {"plan: targets['weld']", "position control"}));
  EXPECT_TRUE(rejects(reading_plan("/velocities/0/body", "tip"), {"plan: velocities['tip']", "a free body"}));
  EXPECT_TRUE(rejects(reading_plan("/velocities/0/force", -1.0), {"plan: limits['pusher'] force is -1"}));
  EXPECT_TRUE(rejects(reading_plan("/velocities/1/torque", "inf"), {"plan.velocities[1].torque is \"inf\""}));
  EXPECT_TRUE(rejects(reading_plan("/velocities/1/limit", 1.0), {"plan.velocities[1] has an unknown \"limit\""}));
  EXPECT_TRUE(
      rejects([] { read_without(planned(), "/plan/velocities/0", "rows"); }, {"plan.velocities[0] has no \"rows\""}));
}

TEST(ProblemIoErrors, RowsThatAreNoneAreRejectedByTheirPlace) {
  const std::string rows = "plan.targets[0].rows is ";
  const auto reading_list = [](const Json& list) { return reading(planned(), "/plan/velocities/2/rows", list); };
  EXPECT_TRUE(rejects(reading_rows(""), {rows + "\"\"", "8 bytes each, and at least one; these are 0 bytes"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8D8"), {rows, "with its \"=\""}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8D8=="), {rows, "with its \"=\""}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8D9="), {rows, "as this library writes it"}));  // a bit that nobody reads
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA 8D8="), {rows, "only digits of base64"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA\xc3\xa9"
                                   "D8="),
                      {rows, "only digits of base64"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8A=="), {rows, "these are 7 bytes"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8D8="), {"plan: targets", "1 rows, expected 7 rows"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA8D8AAAAAAADwfw=="), {rows, "finite numbers, also in row 1"}));
  EXPECT_TRUE(rejects(reading_rows("AAAAAAAA+H8="), {rows, "finite numbers, also in row 0"}));
  EXPECT_TRUE(rejects(reading_list(Json::array()), {"plan.velocities[2].rows is []", "at least one row"}));
  EXPECT_TRUE(rejects(reading_list({{0, 0, 0, 0, 0, 0}, {0, 0, 0}}), {"plan.velocities[2].rows[1]", "6 numbers"}));
  EXPECT_TRUE(rejects(reading_list({{0, 0, 0, 0, 0, "x"}}), {"plan.velocities[2].rows[0][5] is \"x\"", "a number"}));
  EXPECT_TRUE(rejects(reading_list({{0, 0, 0, 0, 0, 0}}), {"plan: velocities['guide'] is 1 rows, expected 7 rows"}));
  EXPECT_TRUE(rejects(reading_list(3), {"plan.velocities[2].rows is 3", "a list of rows, or base64"}));
}

TEST(ProblemIoErrors, JointThatFollowsAFollowerIsRejectedByItsPlace) {
  Json json = Json::parse(to_json(articulated()));
  Json& joints = json["scene"]["joints"];
  Json& bodies = json["scene"]["bodies"];
  ASSERT_EQ(joints.back()["name"], "twin");
  Json body = bodies.back();
  body["name"] = "third";
  bodies.push_back(body);
  Json joint = joints.back();
  joint["name"] = "third";
  joint["child"] = "third";
  joint["in_parent"]["position"] = {0.5, -0.5, 0.3};
  joints.push_back(joint);
  EXPECT_NO_THROW(from_json(json.dump()));
  joints.back()["mimic"]["joint"] = "twin";
  EXPECT_TRUE(rejects([&] { from_json(json.dump()); },
                      {"scene.joints[" + std::to_string(joints.size() - 1) + "]", "'twin'", "follows no other"}));
}

}  // namespace
}  // namespace energymargin

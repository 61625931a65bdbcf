// Problem files: there and back without loss.

#include "energymargin/problem_io.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "problem_files.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = nlohmann::ordered_json;

TEST(ProblemIo, RoundTripGivesTheSameTextForEveryShapeRegionAndJoint) {
  for (const Problem& problem : {everything(), articulated(), planned(), push(), closed_cage(), lift(0.1)}) {
    const std::string text = to_json(problem);
    EXPECT_EQ(to_json(from_json(text)), text);
  }
}

TEST(ProblemIo, RoundTripKeepsEveryNumber) {
  const Problem given = everything();
  const Problem read = from_json(to_json(given));
  EXPECT_TRUE(same_bits(read.state, given.state));
  EXPECT_EQ(read.scene.gravity(), given.scene.gravity());
  EXPECT_EQ(read.scene.stepping().step, given.scene.stepping().step);
  EXPECT_EQ(read.scene.stepping().iterations, 60);
  EXPECT_EQ(read.scene.stepping().tolerance, 1e-8);
  EXPECT_EQ(read.scene.stepping().margin, 0.001);
  EXPECT_EQ(read.scene.disabled_collisions(), given.scene.disabled_collisions());
  EXPECT_EQ(read.rate, given.rate);
  EXPECT_EQ(read.torque, given.torque);
  EXPECT_EQ(std::get<ConvexHull>(read.scene.body("body 4").shape).points,
            std::get<ConvexHull>(given.scene.body("body 4").shape).points);
  EXPECT_EQ(read.contacts->front().normal_force, 1.0 / 3.0);
  EXPECT_FALSE(from_json(to_json(drift())).succeeded);
  EXPECT_FALSE(from_json(to_json(drift())).captured_any);
  EXPECT_FALSE(from_json(to_json(drift())).succeeded_any);
}

TEST(ProblemIo, RoundTripKeepsHowMassIsSpread) {
  const Problem given = everything();
  const Problem read = from_json(to_json(given));
  for (const Body& body : given.scene.bodies()) {
    const Inertial one = read.scene.body(body.name).principal_inertial();
    const Inertial two = body.principal_inertial();
    EXPECT_TRUE(same_bits(one.center, two.center)) << body.name;
    EXPECT_TRUE(same_bits(one.moments, two.moments)) << body.name;
    EXPECT_TRUE(same_bits(one.axes.coeffs(), two.axes.coeffs())) << body.name;
  }
  const auto& solid = std::get<Compound>(read.scene.body("body 5").shape).solid;
  ASSERT_TRUE(solid);
  EXPECT_EQ(solid->volume, mug().solid->volume);
  const Part& part = std::get<Compound>(read.scene.body("body 6").shape).parts[0];
  EXPECT_EQ(part.pose.position, Vector3(0.1, 0.0, 1.0 / 3.0));
  EXPECT_EQ(std::get<Capsule>(part.shape).length, 0.2);
}

TEST(ProblemIo, RoundTripKeepsEveryNumberOfJointsSpringsForcesAndWeights) {
  const Problem given = articulated();
  const Problem read = from_json(to_json(given));
  EXPECT_TRUE(same_bits(read.state, given.state));
  ASSERT_EQ(read.scene.joints().size(), given.scene.joints().size());
  const Joint& rail = read.scene.joints()[read.scene.joint_index("rail")];
  const Joint& own = given.scene.joints()[given.scene.joint_index("rail")];
  EXPECT_EQ(rail.type, JointType::prismatic);
  EXPECT_EQ(rail.parent + rail.child, "palmtool");
  EXPECT_EQ(rail.in_parent.position, own.in_parent.position);
  EXPECT_EQ(rail.in_parent.orientation.coeffs(), own.in_parent.orientation.coeffs());
  EXPECT_EQ(rail.in_child.orientation.coeffs(), own.in_child.orientation.coeffs());
  EXPECT_EQ(rail.axis, own.axis);
  EXPECT_EQ(rail.lower, -infinity);
  EXPECT_EQ(rail.upper, 0.3);
  EXPECT_EQ(rail.state.position, 1.0 / 11.0);
  EXPECT_TRUE(rail.held);
  EXPECT_EQ(rail.target, 0.1);
  EXPECT_EQ(rail.target_velocity, 1.0 / 13.0);
  EXPECT_EQ(rail.stiffness, 100.0 / 3.0);
  EXPECT_EQ(rail.damping, 0.1);
  EXPECT_EQ(rail.torque_limit, 2.0 / 3.0);
  EXPECT_FALSE(rail.mimic);
  const Joint& weld = read.scene.joints()[read.scene.joint_index("weld")];
  EXPECT_EQ(weld.type, JointType::fixed);
  EXPECT_EQ(weld.torque_limit, infinity);
  const Joint& twin = read.scene.joints()[read.scene.joint_index("twin")];
  ASSERT_TRUE(twin.mimic);
  EXPECT_EQ(twin.mimic->joint, "left 1");
  EXPECT_EQ(twin.mimic->multiplier, -1.0 / 3.0);
  EXPECT_EQ(twin.mimic->offset, 0.1);
  const Spring& spring = read.scene.springs().front();
  EXPECT_EQ(spring.body_a + spring.body_b, "tipobject");
  EXPECT_EQ(spring.point_b, Vector3(0.0, 0.01, 1.0 / 300.0));
  EXPECT_EQ(spring.stiffness, 1.0 / 3.0);
  EXPECT_EQ(spring.rest_length, 0.1);
  EXPECT_EQ(spring.damping, 0.01);
  EXPECT_EQ(read.scene.body("tool").force, Vector3(0.1, -1.0 / 3.0, 0.7));
  EXPECT_EQ(read.force_weights.stick, 1.0 / 3.0);
  EXPECT_EQ(read.force_weights.ground_engage, -0.1);
  EXPECT_EQ(read.force_weights.ground_stick, 1.0 / 9.0);
}

TEST(ProblemIo, RoundTripKeepsEveryNumberOfAPlanItsOrderAndItsLimits) {
  const Problem given = planned();
  const Problem read = from_json(to_json(given));
  EXPECT_EQ(to_json(read), to_json(given));
  EXPECT_EQ(read.horizon, given.horizon);
  EXPECT_EQ(read.check, given.check);
  EXPECT_EQ(read.dwell, given.dwell);
  ASSERT_TRUE(read.plan);
  EXPECT_EQ(read.plan->step, given.plan->step);
  ASSERT_EQ(read.plan->wrenches.size(), 2u);
  ASSERT_EQ(read.plan->targets.size(), 2u);
  ASSERT_EQ(read.plan->velocities.size(), 3u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.plan->wrenches[i].body, given.plan->wrenches[i].body);
    EXPECT_TRUE(same_bits(read.plan->wrenches[i].wrenches, given.plan->wrenches[i].wrenches));
    EXPECT_EQ(read.plan->targets[i].joint, given.plan->targets[i].joint);
    EXPECT_TRUE(same_bits(read.plan->targets[i].positions, given.plan->targets[i].positions));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Servo& one = read.plan->velocities[i];
    const Servo& two = given.plan->velocities[i];
    EXPECT_EQ(one.body, two.body);
    EXPECT_TRUE(same_bits(one.velocities, two.velocities));
    EXPECT_EQ(one.force, two.force);
    EXPECT_EQ(one.torque, two.torque);
  }
}

TEST(ProblemIo, RoundTripOfAPlanMovesTheRobotToTheSameBits) {
  const Problem given = planned();
  const Problem read = from_json(to_json(given));
  const Disturbance none(1);
  const Rollout one = World(given.scene, *given.plan).rollout(given.state, {none}, *given.horizon);
  const Rollout two = World(read.scene, *read.plan).rollout(read.state, {none}, *read.horizon);
  EXPECT_TRUE(same_bits(one.state, two.state));
  EXPECT_FALSE(same_bits(one.state, World(given.scene).rollout(given.state, {none}, *given.horizon).state));
}

TEST(ProblemIo, PlanAloneIsWrittenAsInAProblemAndReadWithoutAScene) {
  const std::string text = to_json(*planned().plan);
  EXPECT_EQ(Json::parse(text), Json::parse(to_json(planned()))["plan"]);
  EXPECT_EQ(to_json(plan_from_json(text)), text);
  EXPECT_TRUE(rejects([] { to_json(Plan{0.1}); }, {"plan is empty"}));
  EXPECT_TRUE(rejects([] { plan_from_json(" "); }, {"it is empty, expected the JSON of a plan"}));
  EXPECT_TRUE(rejects([] { plan_from_json("{\"step\": 0.1}"); }, {"plan is empty"}));
}

TEST(ProblemIo, RowsOfAPlanMayBeWrittenAsLists) {
  const std::string text = with_listed_rows(planned());
  EXPECT_EQ(Json::parse(text)["plan"]["targets"][0]["rows"].size(), 7u);
  EXPECT_EQ(to_json(from_json(text)), to_json(planned()));
}

TEST(ProblemIo, PackedRowsAreBase64OfLittleEndianDoubles) {
  Problem problem = planned();
  problem.horizon.reset();
  problem.plan = Plan{problem.scene.stepping().step};
  problem.plan->targets = {{"left 1", Eigen::Vector3d(1.0, -2.0, 0.1)}};
  EXPECT_EQ(Json::parse(to_json(problem))["plan"]["targets"][0]["rows"], "AAAAAAAA8D8AAAAAAAAAwJqZmZmZmbk/");
}

TEST(ProblemIo, EveryFileIsWrittenAsVersion6) {
  for (const Problem& problem : {push(), planned(), everything()}) {
    EXPECT_EQ(Json::parse(to_json(problem))["version"], problem_format_version);
  }
  EXPECT_EQ(problem_format_version, 6);
}

TEST(ProblemIo, RoundTripKeepsAKinematicBody) {
  Problem problem = push(Effector::coast);
  Body hand = body("hand", Sphere{0.1}, 1.0, {9.0, 0.0, 1.0}, Role::effector);
  hand.kinematic = true;
  problem.scene.add_body(hand);
  problem.state = pack(problem.scene);
  EXPECT_TRUE(from_json(to_json(problem)).scene.body("hand").kinematic);
}

TEST(ProblemIo, RoundTripKeepsAnArmatureWhichOtherJointsDoNotWrite) {
  Problem problem = articulated();
  Scene geared(problem.scene.gravity(), problem.scene.stepping());
  for (const Body& body : problem.scene.bodies()) geared.add_body(body);
  for (Joint joint : problem.scene.joints()) {
    if (joint.name == "rail") joint.armature = 1.0 / 3.0;
    geared.add_joint(joint);
  }
  problem.scene = geared;
  const Json json = Json::parse(to_json(problem));
  for (const Json& joint : json["scene"]["joints"]) EXPECT_EQ(joint.contains("armature"), joint["name"] == "rail");
  const Scene read = from_json(to_json(problem)).scene;
  EXPECT_EQ(read.joints()[read.joint_index("rail")].armature, 1.0 / 3.0);
}

TEST(ProblemIo, RoundTripKeepsTheFrictionRuleAndTheFrictionOfPairs) {
  const Scene given = everything().scene;
  const Scene read = from_json(to_json(everything())).scene;
  EXPECT_EQ(read.friction_rule(), FrictionRule::max);
  ASSERT_EQ(read.pair_frictions().size(), 2u);
  for (std::size_t a = 0; a < given.bodies().size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) EXPECT_EQ(read.contact_friction(a, b), given.contact_friction(a, b));
  }
  EXPECT_EQ(read.contact_friction(read.index("plane"), read.index("body 2")), 1.0 / 7.0);
}

TEST(ProblemIo, RoundTripOfAFileGivesTheSameScoreBits) {
  const Folder folder;
  const Problem given = push();
  save(given, folder / "push.json");
  const Problem read = load(folder / "push.json");
  CaptureOptions options;
  options.nodes = 50;
  EXPECT_TRUE(same_bits(capture_score(read, options).capture.mean, capture_score(given, options).capture.mean));
  EXPECT_TRUE(same_bits(escape_effort(read, {"rrt", 50, 1}).tree, escape_effort(given, {"rrt", 50, 1}).tree));
}

TEST(ProblemIo, ReadHandMovesToTheSameBits) {
  const Problem given = articulated();
  const Problem read = from_json(to_json(given));
  Wrench wrench;
  wrench.force.x() = 0.5;
  const Rollout one = World(given.scene).rollout(given.state, {wrench}, 0.1);
  const Rollout two = World(read.scene).rollout(read.state, {wrench}, 0.1);
  EXPECT_TRUE(same_bits(one.state, two.state));
  EXPECT_TRUE(same_bits(one.energy, two.energy));
}

TEST(ProblemIo, PredicateHasNoFileFormat) {
  Problem problem = push();
  problem.captured = ~Region(regions::Predicate{[](const States& s) -> Mask { return s.col(0).array() > 0.0; }});
  EXPECT_TRUE(rejects([&] { to_json(problem); }, {"Predicate", "no file format"}));
}

TEST(ProblemIo, NameThatJsonCannotHoldIsRejected) {
  Scene scene = push_scene();
  scene.add_body(fixed("caf\xe9", Sphere{0.1}, {9.0, 9.0, 9.0}));
  Problem problem = push();
  problem.scene = scene;
  EXPECT_TRUE(rejects([&] { to_json(problem); }, {"name", "UTF-8"}));
}

TEST(ProblemIo, WhateverIsWrittenCanBeReadAgain) {
  Problem problem = push();
  for (int i = 0; i < 100; ++i) problem.captured = problem.captured | regions::Disc{"object", {0.1 * i, 0.0}, 0.1};
  EXPECT_NO_THROW(from_json(to_json(problem)));
}

TEST(ProblemIo, FailedSaveLeavesTheOldFilesAndNothingElse) {
  const Folder folder;
  save(everything(), folder / "old.json", Meshes::files);
  std::filesystem::create_directories(folder / "old-body_5.obj.part");  // where the mesh would be written first
  EXPECT_THROW(save(push(), "/no/such/folder/problem.json"), FileError);
  Problem changed = everything();
  changed.rate = 9.0;
  EXPECT_THROW(save(changed, folder / "old.json", Meshes::files), FileError);
  EXPECT_EQ(load(folder / "old.json").rate, everything().rate);
  EXPECT_FALSE(std::filesystem::exists(folder / "old.json.part"));
  EXPECT_TRUE(std::filesystem::exists(folder / "old-body_5.obj.part"));
}

// A file that version 0.13 wrote, and the warnings of reading it.
std::pair<Problem, std::vector<Warning>> read_older(int version) {
  std::vector<Warning> warnings;
  const auto tests = std::filesystem::path(__FILE__).parent_path().parent_path();
  const std::string name = "version-" + std::to_string(version) + ".json";
  Problem problem = load((tests / "older_problem_files" / name).string(), &warnings);
  return {problem, warnings};
}

TEST(ProblemIo, FilesThatVersion13WroteAreReadWithAllThatTheyHold) {
  const Problem of_3 = read_older(3).first;
  EXPECT_EQ(of_3.state.size(), 26);
  EXPECT_FALSE(of_3.horizon);
  const Problem of_4 = read_older(4).first;
  EXPECT_EQ(of_4.plan->rows(), 60);
  EXPECT_EQ(of_4.dwell, 5 * of_4.scene.stepping().step);
  const Problem of_5 = read_older(5).first;
  EXPECT_EQ(of_5.scene.joints().front().armature, 0.001);
  EXPECT_EQ(of_5.scene.friction_rule(), FrictionRule::max);
  EXPECT_EQ(of_5.scene.pair_frictions().front().friction, 0.25);
  for (const Problem& problem : {of_3, of_4, of_5}) {
    const std::string text = to_json(problem);
    EXPECT_EQ(Json::parse(text)["version"], 6);
    EXPECT_EQ(to_json(from_json(text)), text);
  }
}

TEST(ProblemIo, OlderFileWithOneFrictionDirectionIsDoubtedAndOneWithTwoIsNot) {
  for (const int version : {3, 4}) {
    const std::vector<Warning> warnings = read_older(version).second;
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].text.find("every direction of the contact plane"), std::string::npos);
    EXPECT_NE(warnings[0].text.find("scores may differ"), std::string::npos);
  }
  EXPECT_TRUE(read_older(5).second.empty());
  Json json = Json::parse(to_json(push()));
  json["version"] = 3;
  json["scene"]["friction_directions"] = 3;
  EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene.friction_directions is 3", "1 or 2"}));
}

TEST(ProblemIo, OlderFileIsReadWithTheUsualSettingsOfTodaysSolver) {
  Json json = Json::parse(to_json(push()));
  for (const int version : {3, 4, 5}) {
    json["version"] = version;
    json["scene"]["solver_iterations"] = 3000;
    json["scene"]["solver_tolerance"] = 0.0;  // the solver of that time never stopped early
    const Stepping stepping = from_json(json.dump()).scene.stepping();
    EXPECT_EQ(stepping.iterations, Stepping{}.iterations);
    EXPECT_EQ(stepping.tolerance, Stepping{}.tolerance);
    json["scene"]["solver_tolerance"] = "none";
    EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene.solver_tolerance is \"none\"", "a number"}));
  }
}

TEST(ProblemIo, FileOfVersion6WithFrictionDirectionsIsRejected) {
  for (const int directions : {1, 2}) {
    Json json = Json::parse(to_json(push()));
    json["scene"]["friction_directions"] = directions;
    EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene has an unknown \"friction_directions\""}));
  }
}

TEST(ProblemIo, FileMaySayWhereAnEditorFindsTheSchema) {
  Json json = Json::parse(to_json(push()));
  json["$schema"] = "./problem.schema.json";
  EXPECT_EQ(to_json(from_json(json.dump())), to_json(push()));
}

}  // namespace
}  // namespace energymargin

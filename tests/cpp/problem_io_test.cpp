// Problem files: there and back without loss, and a clear word on a file that is broken.

#include "energymargin/problem_io.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = nlohmann::ordered_json;

// A file of the test's own, removed at its end.
class File {
 public:
  File() : path_(testing::TempDir() + "problem_" + std::to_string(getpid()) + ".json") {}
  ~File() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }
  void write(const std::string& text) const { std::ofstream(path_) << text; }

 private:
  std::string path_;
};

// Reading the push's file with one place changed.
auto reading(const std::string& pointer, const Json& value) {
  return [=] {
    Json json = Json::parse(to_json(push()));
    json[Json::json_pointer(pointer)] = value;
    from_json(json.dump());
  };
}

// A free-standing body of every shape, with numbers that have many digits.
Problem everything() {
  Scene scene(Vector3(0.1, 0.2, -9.7), Stepping{1.0 / 300.0, 60, 1e-8, 2, 0.001});
  scene.add_body(fixed("plane", Plane{Vector3(1.0, 2.0, 3.0).normalized(), -10.0 / 3.0}));
  const std::vector<Shape> shapes{Box{{0.1, 0.2, 1.0 / 3.0}}, Sphere{0.1}, Cylinder{0.1, 0.2}, Capsule{0.1, 0.2},
                                  brick({0.1, 0.2, 0.3}, turn(0.3, Vector3::UnitX()))};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Body made = body("body " + std::to_string(i), shapes[i], 1.0 / (3.0 + static_cast<double>(i)),
                     {2.0 * static_cast<double>(i), 0.0, 3.0}, i == 0 ? Role::object : Role::none, 1.0 / 7.0);
    made.linear_factor = {1.0, 1.0, i == 1 ? 0.0 : 1.0};
    made.angular_factor = {1.0, i == 1 ? 0.0 : 1.0, 1.0};
    made.state.orientation = turn(0.1, Vector3(1.0, 1.0, 1.0).normalized());
    made.state.velocity = {0.1, -0.0, 0.0};
    scene.add_body(made);
  }
  const Region ball = regions::Ball{"body 0", {0.1, 0.2, 0.3}, 0.7, "body 1"};
  const Region box = regions::Box{"body 0", {0.1, 0.2, 0.3}, {infinity, 0.1, infinity}};
  const Region disc = regions::Disc{"body 0", {0.1, 0.2}, 0.7, "plane"};
  const Region sector = regions::AnnularSector{"body 0", {0.1, 0.2}, 0.7, 0.1, 9.0, -1.0, "body 2"};
  const Region half = regions::HalfSpace{"body 0", Vector3(1.0, -1.0, 0.5).normalized(), 0.1};
  const Region speed = regions::Speed{"body 0", 0.1, {0.0, 0.1, 0.0}, "body 3"};
  const Region tilt = regions::Tilt{"body 0", Vector3::UnitX(), Vector3(1.0, 1.0, 1.0).normalized(), 0.1, "body 4"};
  Problem problem{scene, pack(scene), {1.0, 0.0, 0.1}, {0.0, 1.0 / 3.0, 0.0}, 0.7, (ball | box) & ~(disc & sector)};
  problem.succeeded = half & speed;
  regions::Swept swept{"body 0", "body 1", 0.1, 0.2, 0.3, 0.4, 0.5};
  const Region own = swept;
  swept.at = regions::PlanarMotion{{0.1, 0.2}, {0.3, 1.0 / 3.0}, 0.4};
  problem.within = ~(tilt & own) | swept;
  problem.rate = 1.0 / 3.0;
  Contact contact{"body 0", "body 1", {0.1, 0.2, 0.3}, Vector3::UnitX(), -0.001, 1.0 / 3.0, {0.0, 0.1, 0.0}, 0.02};
  problem.contacts = {contact};
  return problem;
}

TEST(ProblemIo, RoundTripGivesTheSameTextForEveryShapeAndRegion) {
  for (const Problem& problem : {everything(), push(), closed_cage(), lift(0.1)}) {
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
  EXPECT_EQ(read.rate, given.rate);
  EXPECT_EQ(read.torque, given.torque);
  EXPECT_EQ(std::get<ConvexHull>(read.scene.body("body 4").shape).points,
            std::get<ConvexHull>(given.scene.body("body 4").shape).points);
  EXPECT_EQ(read.contacts->front().normal_force, 1.0 / 3.0);
  EXPECT_FALSE(from_json(to_json(drift())).succeeded);
}

TEST(ProblemIo, RoundTripOfAFileGivesTheSameScoreBits) {
  const File file;
  const Problem given = push();
  save(given, file.path());
  const Problem read = load(file.path());
  CaptureOptions options;
  options.nodes = 50;
  EXPECT_TRUE(same_bits(capture_score(read, options).capture, capture_score(given, options).capture));
  EXPECT_TRUE(same_bits(escape_effort(read, {"rrt", 50, 1}).tree, escape_effort(given, {"rrt", 50, 1}).tree));
}

TEST(ProblemIo, PredicateHasNoFileFormat) {
  Problem problem = push();
  problem.captured = ~Region(regions::Predicate{[](const States& s) -> Mask { return s.col(0).array() > 0.0; }});
  EXPECT_TRUE(rejects([&] { to_json(problem); }, {"Predicate", "no file format"}));
}

TEST(ProblemIo, WhateverIsWrittenCanBeReadAgain) {
  Problem problem = push();
  for (int i = 0; i < 100; ++i) problem.captured = problem.captured | regions::Disc{"object", {0.1 * i, 0.0}, 0.1};
  EXPECT_NO_THROW(from_json(to_json(problem)));
}

TEST(ProblemIo, FileThatIsNotThereOrEmptyIsRejectedByItsName) {
  const File file;
  EXPECT_THROW(load(file.path()), FileError);
  file.write("");
  EXPECT_TRUE(rejects([&] { load(file.path()); }, {file.path(), "empty"}));
  EXPECT_THROW(save(push(), "/no/such/folder/problem.json"), FileError);
}

TEST(ProblemIo, FileCutOffAnywhereIsRejected) {
  const File file;
  const std::string text = to_json(push());
  for (std::size_t size = 1; size + 2 < text.size(); size += 41) {
    file.write(text.substr(0, size));
    EXPECT_TRUE(rejects([&] { load(file.path()); }, {file.path(), "not valid JSON, or cut off", "byte"})) << size;
  }
}

TEST(ProblemIo, FileOfAnotherFormatOrNewerVersionIsRejected) {
  EXPECT_TRUE(rejects([] { from_json("{}"); }, {"format", "energymargin-problem"}));
  EXPECT_TRUE(rejects([] { from_json("[1, 2]"); }, {"[1,2]", "object"}));
  EXPECT_TRUE(rejects(reading("/format", "urdf"), {"format", "energymargin-problem"}));
  EXPECT_TRUE(rejects(reading("/format", 7), {"format", "7"}));
  EXPECT_TRUE(rejects(reading("/version", 3), {"version is 3", "at most 2", "newer"}));
  EXPECT_TRUE(rejects(reading("/version", "1"), {"version", "\"1\"", "whole number"}));
}

TEST(ProblemIo, MisspeltAndMissingKeysAreRejectedByTheirPlace) {
  EXPECT_TRUE(rejects(reading("/durration", 0.5), {"unknown \"durration\"", "duration"}));
  EXPECT_TRUE(rejects(reading("/scene/gravitiy", 0), {"scene has an unknown \"gravitiy\"", "gravity"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/frictoin", 0), {"scene.bodies[1]", "\"frictoin\"", "friction"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/shape/radius", 1), {"scene.bodies[1].shape", "\"radius\"", "size"}));
  EXPECT_TRUE(rejects(reading("/captured/raduis", 1), {"captured", "\"raduis\"", "radius"}));
  Json json = Json::parse(to_json(push()));
  json["scene"]["bodies"][2].erase("mass");
  EXPECT_TRUE(rejects([&] { from_json(json.dump()); }, {"scene.bodies[2]", "no \"mass\""}));
}

TEST(ProblemIo, ValueOfAnotherTypeIsRejectedByItsPlace) {
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

TEST(ProblemIo, BareNanAndNumbersBeyondAllBoundsAreRejected) {
  const std::string text = to_json(push());
  const auto with_rate = [&](const std::string& number) {
    const std::string key = "\"rate\": 5.0";
    std::string changed = text;
    return changed.replace(changed.find(key), key.size(), "\"rate\": " + number);
  };
  EXPECT_TRUE(rejects([&] { from_json(with_rate("NaN")); }, {"not valid JSON"}));
  EXPECT_TRUE(rejects([&] { from_json(with_rate("1e999")); }, {"1e999"}));
}

TEST(ProblemIo, ValuesThatThePhysicsForbidsAreRejectedByTheirPlace) {
  EXPECT_TRUE(
      rejects(reading("/scene/bodies/1/mass", -1), {"scene.bodies[1]", "'object'", "mass is -1", "at least 0"}));
  EXPECT_TRUE(rejects(reading("/scene/bodies/1/orientation/3", 0.5), {"scene.bodies[1]", "'object'", "unit"}));
  EXPECT_TRUE(rejects(reading("/state/6", 0.5), {"state", "'object'", "orientation", "0.5", "unit"}));
  EXPECT_TRUE(rejects(reading("/state", Json::array({1, 2, 3})), {"state", "3 numbers", "26"}));
  EXPECT_TRUE(rejects(reading("/captured/body", "cup"), {"captured", "'cup'", "'object'"}));
  EXPECT_TRUE(rejects(reading("/succeeded/frame", "cup"), {"succeeded", "'cup'"}));
  EXPECT_TRUE(rejects(reading("/captured/radius", 0), {"captured", "radius is 0", "above 0"}));
  EXPECT_TRUE(rejects(reading("/duration", 0), {"duration is 0", "one step"}));
}

// The push's file with other text for its capture set.
std::string with_captured(const std::string& region) {
  const std::string text = to_json(push());
  return text.substr(0, text.find("\"captured\"")) + "\"captured\": " + region + ", " +
         text.substr(text.find("\"succeeded\""));
}

std::string repeated(const std::string& word, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += word;
  return all;
}

std::string complements(int depth) {
  return with_captured(repeated("{\"type\": \"not\", \"of\": [", depth) + "1" + repeated("]}", depth));
}

TEST(ProblemIo, DeepNestingIsRejectedByItsPlace) {
  EXPECT_TRUE(rejects([] { from_json(complements(70)); }, {"captured.of[0]", "levels"}));
}

TEST(ProblemIo, NestingDeeperThanTheStackIsRejectedAndNotRecursedInto) {
  EXPECT_TRUE(rejects([] { from_json(complements(200000)); }, {"levels"}));
  EXPECT_TRUE(rejects([] { from_json(with_captured(repeated("[", 400000) + repeated("]", 400000))); }, {"levels"}));
}

// ---- joints, springs, constant forces

// A hand with numbers that have many digits, held and fixed joints, oblique frames and a spring.
Problem articulated() {
  Scene scene = hand();
  Body tool = body("tool", Box{{0.02, 0.02, 0.02}}, 1.0 / 7.0, Vector3::Zero());
  tool.force = {0.1, -1.0 / 3.0, 0.7};
  scene.add_body(tool);
  scene.add_body(body("tip", Sphere{0.01}, 1.0 / 30.0, Vector3::Zero()));
  Joint rail = joint("rail", JointType::prismatic, "palm", "tool", Vector3(1.0, 2.0, 2.0) / 3.0, {0.0, 0.3, 1.0 / 3.0});
  rail.in_parent.orientation = turn(0.3, Vector3(1.0, 1.0, 0.0).normalized());
  rail.in_child.orientation = turn(-0.7, Vector3::UnitY());
  rail.held = true;
  rail.state.position = 1.0 / 11.0;
  rail.upper = 0.3;
  rail.target = 0.1;
  rail.target_velocity = 1.0 / 13.0;
  rail.stiffness = 100.0 / 3.0;
  rail.damping = 0.1;
  rail.torque_limit = 2.0 / 3.0;
  scene.add_joint(rail);
  scene.add_joint(joint("weld", JointType::fixed, "tool", "tip", Vector3::UnitZ(), {0.0, 0.0, 0.05}));
  scene.add_spring({"tip", "object", {0.01, 0.0, 0.0}, {0.0, 0.01, 1.0 / 300.0}, 1.0 / 3.0, 0.1, 0.01});
  Problem problem{scene,
                  pack(scene, {}, {{"left 1", {0.5 + 1.0 / 30.0, 1.0 / 7.0}}}),
                  {1.0, 0.0, 0.0},
                  Vector3::Zero(),
                  0.2,
                  regions::Ball{"object"}};
  problem.force_weights = {0.1, 1.0 / 3.0, 7.0, -0.1, 1.0 / 9.0};
  problem.effector = Effector::drive;
  return problem;
}

TEST(ProblemIo, RoundTripKeepsEveryNumberOfJointsSpringsForcesAndWeights) {
  const Problem given = articulated();
  const std::string text = to_json(given);
  const Problem read = from_json(text);
  EXPECT_EQ(to_json(read), text);
  EXPECT_TRUE(same_bits(read.state, given.state));
  EXPECT_EQ(read.scene.stepping().friction_directions, 2);
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
  EXPECT_EQ(read.scene.joints().back().type, JointType::fixed);
  EXPECT_EQ(read.scene.joints().back().torque_limit, infinity);
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

TEST(ProblemIo, ReadHandMovesToTheSameBits) {
  const Problem given = articulated();
  const Problem read = from_json(to_json(given));
  Wrench wrench;
  wrench.force.x() = 0.5;
  const Rollout one = World(given.scene).rollout(given.state, wrench, 0.1);
  const Rollout two = World(read.scene).rollout(read.state, wrench, 0.1);
  EXPECT_TRUE(same_bits(one.state, two.state));
  EXPECT_TRUE(same_bits(one.energy, two.energy));
}

// What version 1 wrote of a problem without joints.
std::string as_version_1(const Problem& problem) {
  Json json = Json::parse(to_json(problem));
  json["version"] = 1;
  json.erase("force_weights");
  for (const char* key : {"joints", "springs", "friction_directions"}) json["scene"].erase(key);
  for (Json& body : json["scene"]["bodies"]) body.erase("force");
  return json.dump();
}

TEST(ProblemIo, FileOfVersion1IsReadWithItsOneFrictionDirectionAndTheUsualWeights) {
  const Problem given = push();
  const Problem read = from_json(as_version_1(given));
  EXPECT_TRUE(same_bits(read.state, given.state));
  EXPECT_EQ(read.scene.stepping().friction_directions, 1);
  EXPECT_TRUE(read.scene.joints().empty());
  EXPECT_TRUE(read.scene.springs().empty());
  EXPECT_EQ(read.scene.body("object").force, Vector3::Zero());
  EXPECT_EQ(read.force_weights.engage, ForceWeights().engage);
  EXPECT_EQ(read.force_weights.distance, ForceWeights().distance);
  EXPECT_EQ(read.force_weights.ground_engage, 0.0);
}

TEST(ProblemIo, JointsAndSpringsThatCannotBeAreRejectedByTheirPlace) {
  const auto reading_hand = [](const std::string& pointer, const Json& value) {
    return [=] {
      Json json = Json::parse(to_json(articulated()));
      json[Json::json_pointer(pointer)] = value;
      from_json(json.dump());
    };
  };
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/0/type", "ball"), {"scene.joints[0].type", "ball", "\"revolute\""}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/0/parent", "cup"), {"scene.joints[0]", "'left 1'", "'cup'"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/lower", 5.0), {"scene.joints[1]", "lower limit is 5"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/uper", 5.0), {"scene.joints[1]", "\"uper\"", "upper"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/joints/1/held", "no"), {"scene.joints[1].held", "\"no\"", "true or false"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/springs/0/stiffness", 1e9), {"scene.springs[0]", "stiffness is 1e+09"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/springs/0/body_a", "cup"), {"scene.springs[0]", "'cup'"}));
  EXPECT_TRUE(rejects(reading_hand("/scene/friction_directions", 1), {"friction_directions", "2"}));
  EXPECT_TRUE(rejects(reading_hand("/force_weights/enage", 1), {"force_weights", "\"enage\"", "engage"}));
}

}  // namespace
}  // namespace energymargin

// Problems: what is a question that can be asked.

#include "energymargin/problem.hpp"

#include <gtest/gtest.h>

#include "energymargin/metrics/escape_energy.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// Validating the push, changed by `change`.
template <typename Change>
auto validating(const Change& change) {
  return [change] {
    Problem problem = push();
    change(problem);
    validate(problem);
  };
}

TEST(Problem, SharedProblemsAreValid) {
  for (const Problem& problem : {push(), push(Effector::coast), closed_cage(), lift(0.1), drift()}) {
    EXPECT_NO_THROW(validate(problem));
  }
}

TEST(Problem, BadStateIsRejectedByBodyQuantityAndValue) {
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.state[0] = nan; }), {"state", "'object'", "position", "nan"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.state = State::Zero(4); }), {"state", "4", "26"}));
}

TEST(Problem, BoundsDurationAndRateThatCannotBeAreRejected) {
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.force.x() = -1.0; }), {"force", "-1", "at least 0"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.torque.z() = infinity; }), {"torque", "inf", "finite"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.duration = 0.001; }), {"duration", "0.001", "one step"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.duration = nan; }), {"duration", "nan"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.rate = -5.0; }), {"rate", "-5", "at least 0"}));
}

TEST(Problem, RegionOnAnUnknownBodyIsRejectedByTheRegionsRole) {
  const Region cup = regions::Disc{"cup"};
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.captured = cup; }), {"captured", "'cup'", "'object'"}));
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.succeeded = cup; }), {"succeeded", "'cup'"}));
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.within = cup; }), {"within", "'cup'"}));
}

TEST(Problem, ThereIsOneObjectOrMore) {
  const auto with_scene = [](const Scene& scene) {
    return [scene] { validate(problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"one"})); };
  };
  Scene none;
  none.add_body(body("one", Box{}, 1.0, Vector3::Zero()));
  EXPECT_TRUE(rejects(with_scene(none), {"scene", "without", "\"object\"", "at least one"}));
  Scene two;
  two.add_body(body("one", Box{}, 1.0, Vector3::Zero(), Role::object));
  two.add_body(body("two", Box{}, 1.0, {5.0, 0.0, 0.0}, Role::object));
  EXPECT_NO_THROW(with_scene(two)());
}

TEST(Problem, DriveNeedsAnEffectorThatCanMove) {
  Problem problem = drift();
  problem.effector = Effector::drive;
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"effector", "\"drive\"", "role \"effector\""}));
}

TEST(Problem, UnderDriveAnEdgeStartsWithTheEffectorsVelocityAtTheStartAndUnderCoastWithItsOwn) {
  const Problem problem = push(Effector::drive);
  std::map<std::string, BodyState> bodies = unpack(problem.scene, problem.state).bodies;
  bodies["effector"].position = {1.1, 0.15, 0.05};
  bodies["effector"].velocity = {0.3, 0.1, 0.0};
  bodies["effector"].angular_velocity = {0.0, 0.0, 2.0};
  bodies["object"].velocity = {0.2, 0.0, 0.0};
  const State node = pack(problem.scene, bodies);
  EXPECT_TRUE(same_bits(EdgeStart(push(Effector::coast))(node), node));
  bodies["effector"].velocity = {0.0, 0.4, 0.0};
  bodies["effector"].angular_velocity.setZero();
  EXPECT_TRUE(same_bits(EdgeStart(problem)(node), pack(problem.scene, bodies)));
}

TEST(Problem, StartInDeepPenetrationIsRejectedWithTheBodiesAndTheDepthAndAGrazeIsNot) {
  const auto sunk = [](double depth) { return validating([depth](Problem& p) { p.state[2] = 0.05 - depth; }); };
  EXPECT_TRUE(rejects(sunk(0.03), {"state", "'object'", "'table'", "0.03 m", "at most 0.025 m"}));
  EXPECT_NO_THROW(sunk(0.012)());
}

TEST(Problem, MeasuredContactsAreChecked) {
  const auto with = [](const Contact& contact) {
    return validating([contact](Problem& p) { p.contacts = {contact}; });
  };
  Contact contact;
  contact.body_a = "object";
  contact.body_b = "effector";
  EXPECT_NO_THROW(with(contact)());
  Contact unknown = contact;
  unknown.body_b = "cup";
  EXPECT_TRUE(rejects(with(unknown), {"'cup'"}));
  Contact forceless = contact;
  forceless.normal_force = nan;
  EXPECT_TRUE(rejects(with(forceless), {"normal_force", "nan"}));
  Contact nowhere = contact;
  nowhere.position.x() = nan;
  EXPECT_TRUE(rejects(with(nowhere), {"position", "nan"}));
}

TEST(Problem, DisturbanceAlongALockedAxisIsRejected) {
  Body planar = body("planar", Box{}, 1.0, {9.0, 0.0, 0.0});
  Scene locked(Vector3::Zero());
  planar.role = Role::object;
  planar.linear_factor = {1.0, 1.0, 0.0};
  planar.angular_factor = {0.0, 0.0, 1.0};
  locked.add_body(planar);
  Problem flat = problem_of(locked, {1.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, 0.5, regions::Ball{"planar", {9.0, 0.0, 0.0}});
  EXPECT_NO_THROW(validate(flat));
  flat.force.z() = 1.0;
  EXPECT_TRUE(rejects([&] { validate(flat); }, {"force", "locked"}));
  flat.force.z() = 0.0;
  flat.torque.x() = 1.0;
  EXPECT_TRUE(rejects([&] { validate(flat); }, {"torque", "locked"}));
}

// ---- several effector bodies

Problem grasp(Effector effector = Effector::coast) {
  const Scene scene = hand();
  Problem problem =
      problem_of(scene, {1.0, 1.0, 1.0}, Vector3::Zero(), 0.2, regions::Ball{"object", {0.0, 0.0, 0.03}, 0.05});
  problem.effector = effector;
  return problem;
}

TEST(Problem, EffectorMayBeAHandOfManyBodies) {
  EXPECT_NO_THROW(validate(grasp()));
  EXPECT_NO_THROW(validate(grasp(Effector::drive)));
}

TEST(Problem, ObjectMayBeOnAJointButNotForScoresOfAFreeBody) {
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("door", Box{}, 1.0, Vector3::Zero(), Role::object));
  scene.add_joint(joint("hinge", JointType::revolute, "post", "door", Vector3::UnitZ(), {1.0, 0.0, 0.0}));
  const Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Joint{"hinge", -1.0, 1.0});
  EXPECT_NO_THROW(validate(problem));
  EXPECT_TRUE(rejects([&] { escape_energy(problem, {}); }, {"'door'", "on a joint", "escape_energy"}));
  EXPECT_TRUE(rejects([&] { World(scene).rollout(pack(scene), Disturbance{}, 0.1); }, {"wrenches", "one an object"}));
}

TEST(Problem, UnderDriveAnEdgeStartsWithTheVelocitiesOfAllEffectorBodiesAndNothingElse) {
  Scene scene = two_boxes_on_a_hinge();
  Scene roles(Vector3::Zero());
  for (Body made : scene.bodies()) {
    if (made.name != "object") made.role = Role::effector;
    roles.add_body(made);
  }
  roles.add_body(body("loose", Sphere{0.1}, 1.0, {0.0, 9.0, 0.0}));
  roles.add_body(body("stirrer", Sphere{0.1}, 1.0, {0.0, 9.0, 3.0}));
  roles.add_joint(scene.joints().front());
  roles.add_joint(joint("other", JointType::revolute, "loose", "stirrer", Vector3::UnitX(), {0.0, 0.0, 3.0}));
  BodyState base = roles.body("base").state;
  base.velocity = {0.1, 0.2, 0.3};
  base.angular_velocity = {0.4, 0.5, 0.6};
  const State start = pack(roles, {{"base", base}}, {{"hinge", {0.1, 0.7}}, {"other", {0.2, 0.8}}});
  Problem problem = problem_of(roles, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Ball{"object", {9.0, 0.0, 0.0}});
  problem.state = start;
  State node = State::LinSpaced(start.size(), 1.0, 2.0);
  EXPECT_TRUE(same_bits(EdgeStart(problem)(node), node));
  problem.effector = Effector::drive;
  State expected = node;
  const StateLayout layout(roles);
  expected.segment<6>(layout.offset(roles.index("base")) + 7) << base.velocity, base.angular_velocity;
  expected[layout.joint_offset(roles.joint_index("hinge")) + 1] = 0.7;
  EXPECT_TRUE(same_bits(EdgeStart(problem)(node), expected));
}

TEST(Problem, FingerDeepInTheObjectIsRejectedWithBothNames) {
  Problem problem = grasp();
  std::map<std::string, JointState> joints = unpack(problem.scene, problem.state).joints;
  joints["thumb 1"].position -= 0.1;
  problem.state = pack(problem.scene, {}, joints);
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"state", "'object'", "'thumb 3'", "penetrate"}));
}

TEST(Problem, ForceWeightsThatAreNotFiniteAreRejectedByName) {
  for (const auto& [name, weight] : {std::pair{"engage", &ForceWeights::engage},
                                     {"stick", &ForceWeights::stick},
                                     {"distance", &ForceWeights::distance},
                                     {"ground_engage", &ForceWeights::ground_engage},
                                     {"ground_stick", &ForceWeights::ground_stick}}) {
    Problem problem = push();
    problem.force_weights.*weight = nan;
    EXPECT_TRUE(rejects([&] { validate(problem); }, {std::string("force_weights: ") + name, "nan", "finite"}));
  }
}

}  // namespace
}  // namespace energymargin

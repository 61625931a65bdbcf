// The force score's terms against their formulas.

#include "energymargin/metrics/force.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

Contact measured(const std::string& a, const std::string& b, double normal_force, const Vector3& tangential_force,
                 double friction) {
  Contact contact;
  contact.body_a = a;
  contact.body_b = b;
  contact.normal_force = normal_force;
  contact.tangential_force = tangential_force;
  contact.friction = friction;
  return contact;
}

TEST(Force, TermsFollowTheFormulasForGivenContacts) {
  Problem problem = push();
  problem.force_weights = {2.0, 3.0, 5.0};
  problem.contacts = {measured("object", "effector", 10.0, {3.0, 4.0, 0.0}, 0.75),
                      measured("effector", "object", 2.0, {0.0, 0.0, 0.5}, 0.5),
                      measured("object", "table", 100.0, Vector3::Zero(), 0.5)};
  const ForceScore score = force_score(problem);
  // cos(atan(3/4)) = 4/5, cos(atan(1/2)) = 2/sqrt(5).
  const double stick = (0.75 * 10.0 - 5.0) * 0.8 + (0.5 * 2.0 - 0.5) * 2.0 / std::sqrt(5.0);
  EXPECT_NEAR(score.effector.engage, 12.0, 1e-12);
  EXPECT_NEAR(score.effector.stick, stick, 1e-12);
  EXPECT_NEAR(score.distance, 0.0, 1e-6);
  EXPECT_NEAR(score.force, 2.0 * 12.0 + 3.0 * stick - 5.0 * score.distance, 1e-12);
}

TEST(Force, WithoutContactOnlyTheDistanceCounts) {
  Problem problem = push();
  BodyState effector = problem.scene.body("effector").state;
  effector.position.y() = -0.2;
  problem.state = pack(problem.scene, {{"effector", effector}});
  const ForceScore score = force_score(problem);
  EXPECT_EQ(score.effector.engage, 0.0);
  EXPECT_EQ(score.effector.stick, 0.0);
  EXPECT_NEAR(score.distance, 0.3, 1e-5);
  EXPECT_NEAR(score.force, -10.0 * score.distance, 1e-12);
}

TEST(Force, SimulatedContactsBearTheObjectsWeight) {
  // A block at rest on an effector that is held in place: all of its weight, none of it sideways.
  Scene scene(Vector3(0.0, 0.0, -g), exact());
  Body tray = fixed("tray", Box{{1.0, 1.0, 0.1}}, {0.0, 0.0, -0.05}, 0.5);
  tray.role = Role::effector;
  scene.add_body(tray);
  scene.add_body(body("object", Box{{0.2, 0.2, 0.2}}, 2.0, {0.0, 0.0, 0.1}, Role::object, 0.8));
  const Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"object"});
  const ForceScore score = force_score(problem);
  const double weight = 2.0 * g / (1.0 + giving);  // in the first step
  EXPECT_NEAR(score.effector.engage, weight, 1e-6);
  EXPECT_NEAR(score.effector.stick, 0.4 * weight / std::sqrt(1.16), 1e-6);
  EXPECT_NEAR(score.distance, 0.0, 1e-5);
}

TEST(Force, WithoutAnEffectorOrWithBadWeightsItIsRejected) {
  EXPECT_TRUE(rejects([] { force_score(drift()); }, {"effector"}));
  Problem weightless = push();
  weightless.force_weights.engage = nan;
  EXPECT_TRUE(rejects([&] { force_score(weightless); }, {"engage", "nan", "finite"}));
}

TEST(Force, FingersCountTogetherAndTheGroundApart) {
  const Scene scene = hand();
  Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.2, regions::Ball{"object"});
  problem.contacts = {measured("object", "left 3", 10.0, {3.0, 4.0, 0.0}, 0.75),
                      measured("thumb 3", "object", 2.0, {0.0, 0.0, 0.5}, 0.5),
                      measured("object", "table", 100.0, {0.0, 30.0, 0.0}, 0.75),
                      measured("left 3", "table", 7.0, Vector3::Zero(), 0.5)};
  problem.force_weights = {2.0, 3.0, 5.0, 0.25, 0.125};
  const ForceScore score = force_score(problem);
  const double stick = (0.75 * 10.0 - 5.0) * 0.8 + (0.5 * 2.0 - 0.5) * 2.0 / std::sqrt(5.0);
  EXPECT_NEAR(score.effector.engage, 12.0, 1e-12);
  EXPECT_NEAR(score.effector.stick, stick, 1e-12);
  EXPECT_NEAR(score.ground.engage, 100.0, 1e-12);
  EXPECT_NEAR(score.ground.stick, (75.0 - 30.0) * 0.8, 1e-12);
  EXPECT_NEAR(score.distance, 0.0, 1e-6);
  EXPECT_NEAR(score.force, 2.0 * 12.0 + 3.0 * stick + 0.25 * 100.0 + 0.125 * 36.0 - 5.0 * score.distance, 1e-12);
}

TEST(Force, SimulatedGraspBearsItsSqueezeAndTheDistanceIsThatOfTheNearestFinger) {
  const Scene scene = hand();
  Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.2, regions::Ball{"object"});
  EXPECT_NEAR(force_score(problem).effector.engage, 4.0, 0.6);  // 2 N from the thumb, 1 N from each of the others
  EXPECT_GT(force_score(problem).ground.engage, 0.1 * g);       // gravity curls the fingers: they press down
  std::map<std::string, JointState> open = unpack(scene, problem.state).joints;
  for (const char* name : {"left 1", "right 1", "thumb 1"}) open.at(name).position += 0.2;
  open.at("thumb 1").position += 0.2;
  problem.state = pack(scene, {}, open);
  const ForceScore apart = force_score(problem);
  EXPECT_EQ(apart.effector.engage, 0.0);
  EXPECT_NEAR(apart.ground.engage, 0.1 * g, 1e-3);
  World world(scene);
  EXPECT_EQ(apart.distance, world.distance(problem.state, "object", "left 3"));
  EXPECT_GT(world.distance(problem.state, "object", "thumb 3"), apart.distance + 0.01);
}

}  // namespace
}  // namespace energymargin

// The force score's terms against their formulas.

#include "energymargin/metrics/force.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "expect.hpp"
#include "scenes.hpp"

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
  problem.contacts = {measured("object", "effector", 10.0, {3.0, 4.0, 0.0}, 0.75),
                      measured("effector", "object", 2.0, {0.0, 0.0, 0.5}, 0.5),
                      measured("object", "table", 100.0, Vector3::Zero(), 0.5)};
  const ForceScore score = force_score(problem, {2.0, 3.0, 5.0});
  // cos(atan(3/4)) = 4/5, cos(atan(1/2)) = 2/sqrt(5).
  const double stick = (0.75 * 10.0 - 5.0) * 0.8 + (0.5 * 2.0 - 0.5) * 2.0 / std::sqrt(5.0);
  EXPECT_NEAR(score.engage, 12.0, 1e-12);
  EXPECT_NEAR(score.stick, stick, 1e-12);
  EXPECT_NEAR(score.distance, 0.0, 1e-6);
  EXPECT_NEAR(score.force, 2.0 * 12.0 + 3.0 * stick - 5.0 * score.distance, 1e-12);
}

TEST(Force, WithoutContactOnlyTheDistanceCounts) {
  Problem problem = push();
  BodyState effector = problem.scene.body("effector").state;
  effector.position.y() = -0.2;
  problem.state = pack(problem.scene, {{"effector", effector}});
  const ForceScore score = force_score(problem);
  EXPECT_EQ(score.engage, 0.0);
  EXPECT_EQ(score.stick, 0.0);
  EXPECT_NEAR(score.distance, 0.3, 1e-5);
  EXPECT_NEAR(score.force, -10.0 * score.distance, 1e-12);
}

TEST(Force, SimulatedContactsBearTheObjectsWeight) {
  // A block at rest on an effector that is held in place: all of its weight, none of it sideways.
  Scene scene(Vector3(0.0, 0.0, -g), exact());
  Body tray = fixed("tray", Box{{1.0, 1.0, 0.1}}, {0.0, 0.0, -0.05}, 0.5);
  tray.role = Role::effector;
  scene.add_body(tray);
  scene.add_body(body("object", Box{{0.2, 0.2, 0.2}}, 2.0, {0.0, 0.0, 0.1 - 1e-6}, Role::object, 0.8));
  const Problem problem{scene, pack(scene), {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"object"}};
  const ForceScore score = force_score(problem);
  EXPECT_NEAR(score.engage, 2.0 * g, 1e-6);
  EXPECT_NEAR(score.stick, 0.4 * 2.0 * g / std::sqrt(1.16), 1e-6);
  EXPECT_NEAR(score.distance, 0.0, 1e-5);
}

TEST(Force, WithoutAnEffectorOrWithBadWeightsItIsRejected) {
  EXPECT_TRUE(rejects([] { force_score(drift()); }, {"effector"}));
  EXPECT_TRUE(rejects([] { force_score(push(), {nan, 1.0, 1.0}); }, {"engage", "nan", "finite"}));
}

}  // namespace
}  // namespace energymargin

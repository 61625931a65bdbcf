// Sets of states in which two bodies touch.

#include <gtest/gtest.h>

#include "energymargin/membership.hpp"
#include "energymargin/parallel.hpp"
#include "energymargin/signed_distance.hpp"
#include "energymargin/world.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A cup of two solids that lies on a table, and a finger beside it.
Scene table() {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  const Box half{{0.05, 0.1, 0.1}};
  scene.add_body(body("cup", Compound{{{half, {{-0.025, 0.0, 0.05}}}, {half, {{0.025, 0.0, 0.05}}}}}, 0.4,
                      {0.0, 0.0, 0.0}, Role::object));
  scene.add_body(body("finger", Sphere{0.02}, 0.1, {0.09, 0.0, 0.05}, Role::effector));
  return scene;
}

// The finger at distances from the cup, between -1 mm and 1 mm.
States approaches(const Scene& scene, int count) {
  const State start = pack(scene);
  const int x = StateLayout(scene).offset(scene.index("finger"));
  States states = start.transpose().replicate(count, 1);
  for (int i = 0; i < count; ++i) states(i, x) = 0.07 + 0.002 * i / (count - 1.0) - 0.001;
  return states;
}

TEST(Touching, SetsHaveTheSignOfTheirDistance) {
  const Scene scene = table();
  const States states = approaches(scene, 41);
  for (const double force : {0.0, 0.005}) {
    const regions::Touching set{"finger", "cup", force, 2e-4};
    const Membership inside(set, scene);
    const SignedDistance distance(set, scene, pack(scene));
    EXPECT_EQ(distance.sizes().size(), force > 0.0 ? 2U : 1U);
    int count = 0;
    for (int i = 0; i < states.rows(); ++i) {
      EXPECT_EQ(distance(states.row(i)) <= 0.0, inside(State(states.row(i)))) << i;
      count += inside(State(states.row(i))) ? 1 : 0;
    }
    EXPECT_TRUE(count > 10 && count < 30) << count;
  }
}

TEST(Touching, TheForceIsThatOfAllContactsOfTheTwoInAStepOfTheWorld) {
  const Scene scene = table();
  World world(scene);
  const State rest = world.rollout(pack(scene), {Wrench{}}, 0.5).state;
  double force = 0.0;
  int count = 0;
  for (const Contact& contact : world.contacts(rest)) {
    if (contact.body_a != "cup" && contact.body_b != "cup") continue;
    force += contact.normal_force;
    ++count;
  }
  EXPECT_GE(count, 4);
  EXPECT_NEAR(force, 0.4 * g, 1e-3 * g);
  for (const auto& [share, inside] : {std::pair{1.0 - 1e-9, true}, std::pair{1.0 + 1e-9, false}}) {
    EXPECT_EQ(Membership(regions::Touching{"table", "cup", share * force}, scene)(rest), inside);
  }
}

TEST(Touching, ManyThreadsMayAskOneSet) {
  const Scene scene = table();
  const States states = approaches(scene, 400);
  const Membership inside(regions::Touching{"cup", "finger", 0.005}, scene);
  const Mask expected = inside(states);
  std::vector<char> answers(400);
  parallel_for(400, 4,
               [&](std::size_t i) { answers[i] = inside(State(states.row(static_cast<Eigen::Index>(i)))) ? 1 : 0; });
  for (std::size_t i = 0; i < answers.size(); ++i) EXPECT_EQ(answers[i] == 1, expected(static_cast<Eigen::Index>(i)));
}

TEST(Touching, StatesThatAreNotFiniteOrFarOutAreOutside) {
  const Scene scene = table();
  const int x = StateLayout(scene).offset(scene.index("finger"));
  for (const double force : {0.0, 1.0}) {
    const Membership inside(regions::Touching{"cup", "finger", force}, scene);
    for (const double place : {nan, infinity, 1e6, 1e100, -1e300}) {
      State state = pack(scene);
      state[x] = place;
      EXPECT_FALSE(inside(state)) << place;
    }
  }
}

TEST(Touching, BodiesThatNeverCollideAreRefusedByName) {
  Scene scene = table();
  scene.add_body(fixed("wall", Box{}));
  scene.add_body(fixed("frame", Compound{}));
  const auto asks = [&](const std::string& a, const std::string& b) {
    return [&scene, a, b] { Membership(regions::Touching{a, b}, scene); };
  };
  EXPECT_TRUE(rejects(asks("wall", "table"), {"other is 'table'", "never collides with 'wall'"}));
  EXPECT_TRUE(rejects(asks("cup", "frame"), {"'frame'", "never collides with 'cup'"}));
  EXPECT_TRUE(rejects(asks("cup", "thumb"), {"'thumb'"}));
}

}  // namespace
}  // namespace energymargin

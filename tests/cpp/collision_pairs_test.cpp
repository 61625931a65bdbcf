// Of many bodies only those near each other are paired: what happens is what happens when every pair is kept.

#include "physics/contacts/collision_pairs.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "physics/shapes.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

using Pairs = std::set<std::pair<std::size_t, std::size_t>>;

btVector3 random_vector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> number(-size, size);
  const double x = number(random);
  const double y = number(random);
  return {x, y, number(random)};
}

TEST(NearPairs, FindsAllPairsWithinTheirReachesAndNoOthers) {
  std::mt19937 random(1);
  int found = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<Bounds> boxes{{btVector3(-1e18, -1e18, -1e18), btVector3(1e18, 1e18, 1e18)}};
    for (int i = 0; i < 40; ++i) {
      const btVector3 center = random_vector(random, 1.0) + btVector3(round % 3 == 0 ? 1e6 : 0.0, 0.0, 0.0);
      const btVector3 half = random_vector(random, 0.2).absolute();
      boxes.push_back({center - half, center + half});
    }
    std::vector<double> reaches;
    for (std::size_t i = 0; i < boxes.size(); ++i) reaches.push_back(i % 4 == 0 ? 0.0 : 0.002 * static_cast<double>(i));
    Pairs near;
    for (std::size_t a = 0; a < boxes.size(); ++a) {
      for (std::size_t b = a + 1; b < boxes.size(); ++b) {
        if (gap_of(boxes[a], boxes[b]) <= reaches[a] + reaches[b]) near.emplace(a, b);
      }
    }
    Pairs visited;
    for (const auto& [a, b] : near_pairs(boxes, reaches)) {
      EXPECT_TRUE(visited.emplace(a, b).second) << a << " and " << b << " come twice";
    }
    EXPECT_EQ(visited, near) << "round " << round;
    found += static_cast<int>(near.size());
  }
  EXPECT_GT(found, 200 * 45);  // more than those of the first box, which all are near
}

// One box that is nowhere finds itself near all others; they keep their own pairs.
TEST(NearPairs, ABoxThatIsNotANumberDisturbsNoOtherPair) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Bounds> boxes;
  for (int i = 0; i < 50; ++i) boxes.push_back({btVector3(0.9 * i, 0, 0), btVector3(0.9 * i + 1.0, 1, 1)});
  boxes.push_back({btVector3(nan, nan, nan), btVector3(nan, nan, nan)});
  Pairs visited;
  for (const auto& [a, b] : near_pairs(boxes, std::vector<double>(boxes.size(), 0.0))) visited.emplace(a, b);
  for (std::size_t i = 0; i + 1 < 50; ++i) EXPECT_EQ(visited.count({i, i + 1}), 1U) << i;
}

// Boxes, balls and cylinders that fall onto a table, close to each other, and that the first one is thrown into.
Scene heap(int bodies, unsigned int seed) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  const std::vector<Shape> shapes{Box{{0.1, 0.08, 0.06}}, Sphere{0.04}, Cylinder{0.04, 0.08}};
  std::mt19937 random(seed);
  for (int i = 0; i < bodies; ++i) {
    const Vector3 place(0.1 * (i % 3), 0.1 * (i / 3 % 3), 0.06 + 0.1 * (i / 9));
    Body each = body(std::to_string(i), shapes[static_cast<std::size_t>(i) % 3], 0.2,
                     place + from_bullet(random_vector(random, 0.008)), i == 0 ? Role::object : Role::none);
    each.state.velocity = from_bullet(random_vector(random, 2.0));
    scene.add_body(each);
  }
  return scene;
}

Scene with_far_bodies(Scene scene) {
  for (int i = 0; scene.bodies().size() <= CollisionPairs::few_bodies; ++i) {
    scene.add_body(fixed("far " + std::to_string(i), Box{}, {1e3 + 10.0 * i, 0.0, 10.0}));
  }
  return scene;
}

TEST(CollisionPairsTest, BodiesFarAwayChangeNoBitOfAHeapThoughPairsAreSearchedForThen) {
  for (unsigned int seed = 0; seed < 3; ++seed) {
    const Scene few = heap(27, seed);
    const Scene many = with_far_bodies(few);
    ASSERT_LE(few.bodies().size(), CollisionPairs::few_bodies);
    ASSERT_GT(many.bodies().size(), CollisionPairs::few_bodies);
    World all_pairs(few);
    World near_pairs(many);
    const Wrench throwing{{3.0, 2.0, 0.0}, {0.0, 0.0, 0.05}};
    for (const int steps : {150, 40, 150}) {  // also after another rollout
      const Rollout expected = all_pairs.rollout_unchecked(pack(few), {push({throwing}, steps)});
      const Rollout rollout = near_pairs.rollout_unchecked(pack(many), {push({throwing}, steps)});
      EXPECT_TRUE(same_bits(rollout.state, expected.state)) << "seed " << seed << ", " << steps << " steps";
      EXPECT_TRUE(same_bits(rollout.effort, expected.effort)) << "seed " << seed << ", " << steps << " steps";
    }
    EXPECT_GE(all_pairs.contacts(all_pairs.rollout_unchecked(pack(few), {push({throwing}, 150)}).state).size(), 40U);
  }
}

TEST(CollisionPairsTest, DeepestContactOfManyBodiesIsThatOfAllPairs) {
  const Scene few = heap(27, 3);
  const Scene many = with_far_bodies(few);
  State state = pack(few);
  state.segment<3>(13 * 5) = state.segment<3>(13 * 4) + Vector3(0.03, 0.0, 0.01);
  const Contact expected = deepest_contact(few, state);
  const Contact deepest = deepest_contact(many, state);
  EXPECT_LT(expected.distance, -0.01);
  EXPECT_TRUE(same_bits(deepest.distance, expected.distance));
  EXPECT_EQ(deepest.body_a + deepest.body_b, expected.body_a + expected.body_b);
}

// A bullet goes 10 times its size in a step, past bodies that it is not near at either end.
TEST(CollisionPairsTest, ManyBodiesStopABulletThatWasNearNoneOfThem) {
  Scene scene(Vector3::Zero());
  Body bullet = body("bullet", Sphere{0.01}, 0.01, {0.0, 0.0, 0.0}, Role::object);
  bullet.state.velocity = {48.0, 0.0, 0.0};
  scene.add_body(bullet);
  scene.add_body(fixed("wall", Box{{0.02, 1.0, 1.0}}, {0.6, 0.0, 0.0}));
  const Scene many = with_far_bodies(scene);
  const State end = World(many).rollout_unchecked(pack(many), {push({Wrench{}}, 10)}).state;
  EXPECT_LT(end[0], 0.6);
  EXPECT_TRUE(same_bits(end, World(scene).rollout_unchecked(pack(scene), {push({Wrench{}}, 10)}).state));
}

}  // namespace
}  // namespace energymargin

// Rollouts are pure functions: the same bits in any order and in any world.

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

struct Question {
  State state;
  Wrench wrench;
  int steps;
};

// Rollouts from states along random pushes: in contact, out of it, and far apart.
std::vector<Question> questions(const Scene& scene, int count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  World world(scene);
  std::vector<Question> asked;
  State state = pack(scene);
  for (int i = 0; i < count; ++i) {
    Question question{state, Wrench(), 1 + static_cast<int>(random() % 100)};
    question.wrench.force.x() = 0.8 * even(random);
    question.wrench.force.y() = 0.8 * even(random);
    question.wrench.torque.z() = 0.05 * even(random);
    state = world.rollout_unchecked(question.state, question.wrench, question.steps).state;
    asked.push_back(std::move(question));
    if (i % 15 == 14) state = pack(scene);
  }
  return asked;
}

std::vector<Rollout> answers(World& world, const std::vector<Question>& asked, const std::vector<std::size_t>& order) {
  std::vector<Rollout> rollouts(asked.size());
  for (const std::size_t i : order) {
    rollouts[i] = world.rollout_unchecked(asked[i].state, asked[i].wrench, asked[i].steps);
  }
  return rollouts;
}

int differing(const std::vector<Rollout>& a, const std::vector<Rollout>& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    count += same_bits(a[i].state, b[i].state) && same_bits(a[i].effort, b[i].effort) ? 0 : 1;
  }
  return count;
}

// The push with walls and a loose block about, so that there are many contacts to order.
Scene crowded_push() {
  Scene scene = push_scene();
  scene.add_body(fixed("wall", Box{{3.0, 0.2, 0.2}}, {1.0, 0.9, 0.1}));
  scene.add_body(body("loose", brick({0.2, 0.2, 0.2}), 0.5, {0.5, 0.7, 0.1}));
  return scene;
}

class WorldPurity : public testing::Test {
 protected:
  WorldPurity() : scene(crowded_push()), asked(questions(scene, 300)), in_order(asked.size()), world(scene) {
    std::iota(in_order.begin(), in_order.end(), 0u);
    expected = answers(world, asked, in_order);
  }

  Scene scene;
  std::vector<Question> asked;
  std::vector<std::size_t> in_order;
  World world;
  std::vector<Rollout> expected;
};

TEST_F(WorldPurity, QuestionsTouchManyContacts) {
  int touching = 0;
  for (const Question& question : asked) touching += world.contacts(question.state).size() >= 8 ? 1 : 0;
  EXPECT_GT(touching, 200);
}

TEST_F(WorldPurity, RolloutsInShuffledOrderGiveTheSameBits) {
  std::vector<std::size_t> shuffled = in_order;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  EXPECT_EQ(differing(answers(world, asked, shuffled), expected), 0);
}

TEST_F(WorldPurity, RolloutsInTwoWorldsGiveTheSameBits) {
  World other(scene);
  std::vector<std::size_t> backwards(in_order.rbegin(), in_order.rend());
  EXPECT_EQ(differing(answers(other, asked, backwards), expected), 0);
}

TEST_F(WorldPurity, RolloutsAfterEveryOtherQuestionGiveTheSameBits) {
  const Drive drive{"effector", Wrenches::Constant(30, 6, 1.0)};
  for (std::size_t i = 0; i < asked.size(); i += 10) {
    const Question& other = asked[(i + 5) % asked.size()];
    world.simulate(other.state, {drive}, 30, {7, 30});
    world.contacts(other.state);
    world.distance(other.state, "object", "effector");
    world.deepest_contact(other.state);
    const Rollout again = world.rollout_unchecked(asked[i].state, asked[i].wrench, asked[i].steps);
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

}  // namespace
}  // namespace energymargin

// Rollouts are pure functions: the same bits in any order and in any world.

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <thread>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

struct Question {
  State state;
  Disturbance wrenches;
  int steps;
};

// Rollouts from states along random pushes: in contact, out of it, and far apart.
std::vector<Question> questions(const Scene& scene, int count, unsigned int longest = 100) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  World world(scene);
  std::vector<Question> asked;
  State state = pack(scene);
  for (int i = 0; i < count; ++i) {
    Question question{state, Disturbance(scene.with_role(Role::object).size()),
                      1 + static_cast<int>(random() % longest)};
    for (Wrench& wrench : question.wrenches) {
      wrench.force.x() = 0.8 * even(random);
      wrench.force.y() = 0.8 * even(random);
      wrench.torque.z() = 0.05 * even(random);
    }
    state = world.rollout_unchecked(question.state, question.wrenches, question.steps).state;
    asked.push_back(std::move(question));
    if (i % 15 == 14) state = pack(scene);
  }
  return asked;
}

std::vector<Rollout> answers(World& world, const std::vector<Question>& asked, const std::vector<std::size_t>& order) {
  std::vector<Rollout> rollouts(asked.size());
  for (const std::size_t i : order) {
    rollouts[i] = world.rollout_unchecked(asked[i].state, asked[i].wrenches, asked[i].steps);
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
    world.simulate(other.state, {{drive}}, 30, {7, 30});
    world.contacts(other.state);
    world.distance(other.state, "object", "effector");
    world.deepest_contact(other.state);
    const Rollout again = world.rollout_unchecked(asked[i].state, asked[i].wrenches, asked[i].steps);
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

// ---- articulated bodies

TEST(HandPurity, TwoThousandRolloutsShuffledInOtherWorldsAndThreadsGiveTheSameBits) {
  const Scene scene = hand();
  const std::vector<Question> asked = questions(scene, 2000, 20);
  World world(scene);
  std::vector<std::size_t> order(asked.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::vector<Rollout> expected = answers(world, asked, order);

  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  EXPECT_EQ(differing(answers(world, asked, order), expected), 0) << "shuffled";
  std::vector<Rollout> threaded(asked.size());
  const std::size_t half = asked.size() / 2;
  const auto work = [&](std::size_t first, std::size_t last) {
    World other(scene);
    for (std::size_t i = first; i < last; ++i) {
      const Question& question = asked[order[i]];
      threaded[order[i]] = other.rollout_unchecked(question.state, question.wrenches, question.steps);
    }
  };
  std::thread one(work, 0, half);
  std::thread two(work, half, asked.size());
  one.join();
  two.join();
  EXPECT_EQ(differing(threaded, expected), 0) << "in two threads";
}

TEST(HandPurity, QuestionsTouchTheFingersAndTheTable) {
  const Scene scene = hand();
  World world(scene);
  int fingers = 0;
  int table = 0;
  for (const Question& question : questions(scene, 300, 20)) {
    for (const Contact& contact : world.contacts(question.state)) {
      fingers += contact.normal_force > 0.1 && contact.body_b != "table" ? 1 : 0;
      table += contact.normal_force > 0.1 && contact.body_b == "table" ? 1 : 0;
    }
  }
  EXPECT_GT(fingers, 500);
  EXPECT_GT(table, 500);
}

TEST(HandPurity, RolloutsAfterTargetsDrivesAndOtherQuestionsGiveTheSameBits) {
  const Scene scene = hand();
  const std::vector<Question> asked = questions(scene, 60, 20);
  World world(scene);
  std::vector<std::size_t> order(asked.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::vector<Rollout> expected = answers(world, asked, order);
  const Script script{{steady("thumb 2", {0.2, 0.1, 0.3}, Vector3::Zero(), 10)},
                      {{"left 1", Eigen::VectorXd::Constant(10, 1.0)}}};
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const State& other = asked[(i + 7) % asked.size()].state;
    world.simulate(other, script, 10, {3, 10});
    world.contacts(other);
    world.distance(other, "object", "thumb 3");
    world.deepest_contact(other);
    const Rollout again = world.rollout_unchecked(asked[i].state, asked[i].wrenches, asked[i].steps);
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

}  // namespace
}  // namespace energymargin

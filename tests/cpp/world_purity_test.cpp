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

// ---- compounds, hulls and several objects

// A bar of two hulls off its frame, an angle of boxes and a bowl, pushed about together on a table made of two plates.
Scene compounds() {
  Scene scene;
  scene.add_body(fixed("ground", Plane{Vector3::UnitZ(), -0.1}));
  scene.add_body(fixed("table", Compound{{{Box{{1.0, 2.0, 0.1}}, {{0.5, 0.0, -0.05}}},
                                          {brick({1.0, 2.0, 0.1}), {{-0.5, 0.0, -0.05}}}}}));
  const Quaternion none = Quaternion::Identity();
  scene.add_body(body("bar",
                      Compound{{{brick({0.1, 0.1, 0.06}, none, {0.05, 0.0, 0.03})},
                                {brick({0.1, 0.1, 0.06}, none, {0.15, 0.0, 0.03})}}},
                      0.3, {0.02, 0.0, 0.0}, Role::object, 0.3));
  scene.add_body(body(
      "angle", Compound{{{Box{{0.15, 0.05, 0.05}}, {{0.05, 0.0, 0.025}}}, {Box{{0.05, 0.05, 0.1}}, {{0.0, 0.0, 0.1}}}}},
      0.3, {0.05, 0.1, 0.0}, Role::object, 0.3));
  scene.add_body(body("bowl",
                      Compound{{{Box{{0.2, 0.2, 0.01}}, {{0.0, 0.0, 0.005}}},
                                {Box{{0.01, 0.2, 0.1}}, {{0.095, 0.0, 0.06}}},
                                {Box{{0.01, 0.2, 0.1}}, {{-0.095, 0.0, 0.06}}},
                                {Box{{0.18, 0.01, 0.1}}, {{0.0, 0.095, 0.06}}},
                                {Box{{0.18, 0.01, 0.1}}, {{0.0, -0.095, 0.06}}}}},
                      0.3, {-0.12, 0.02, 0.0}, Role::none, 0.3));
  scene.add_body(body("ball", Sphere{0.03}, 0.1, {-0.12, 0.02, 0.041}, Role::object, 0.3));
  return scene;
}

class CompoundPurity : public testing::Test {
 protected:
  CompoundPurity() : scene(compounds()), asked(questions(scene, 300, 40)), order(asked.size()), world(scene) {
    std::iota(order.begin(), order.end(), 0u);
    expected = answers(world, asked, order);
  }

  Scene scene;
  std::vector<Question> asked;
  std::vector<std::size_t> order;
  World world;
  std::vector<Rollout> expected;
};

TEST_F(CompoundPurity, QuestionsTouchPlatesHullsAndEachOther) {
  int table = 0;
  int others = 0;
  for (const Question& question : asked) {
    for (const Contact& contact : world.contacts(question.state)) {
      if (contact.normal_force < 0.01) continue;
      const bool on_table = contact.body_a == "table" || contact.body_b == "table";
      (on_table ? table : others) += 1;
    }
  }
  EXPECT_GT(table, 1000);
  EXPECT_GT(others, 300);
}

TEST_F(CompoundPurity, RolloutsShuffledInOtherWorldsAndThreadsGiveTheSameBits) {
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  EXPECT_EQ(differing(answers(world, asked, order), expected), 0) << "shuffled";
  World other(scene);
  EXPECT_EQ(differing(answers(other, asked, {order.rbegin(), order.rend()}), expected), 0) << "in another world";
  std::vector<Rollout> threaded(asked.size());
  const std::size_t half = asked.size() / 2;
  const auto work = [&](std::size_t first, std::size_t last) {
    World own(scene);
    for (std::size_t i = first; i < last; ++i) {
      const Question& question = asked[order[i]];
      threaded[order[i]] = own.rollout_unchecked(question.state, question.wrenches, question.steps);
    }
  };
  std::thread one(work, 0, half);
  std::thread two(work, half, asked.size());
  one.join();
  two.join();
  EXPECT_EQ(differing(threaded, expected), 0) << "in two threads";
}

TEST_F(CompoundPurity, RolloutsAfterEveryOtherQuestionGiveTheSameBits) {
  for (std::size_t i = 0; i < asked.size(); i += 5) {
    const Question& other = asked[(i + 7) % asked.size()];
    world.simulate(other.state, {{steady("bowl", {0.5, 0.3, 1.0}, {0.01, 0.0, 0.0}, 20)}}, 20, {7, 20});
    world.contacts(other.state);
    world.distance(other.state, "bar", "angle");
    world.distance(other.state, "bowl", "ball");
    world.deepest_contact(other.state);
    const Rollout again = world.rollout_unchecked(asked[i].state, asked[i].wrenches, asked[i].steps);
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

TEST(PlanarPurity, TurningAboutAnAxisThatIsNoPrincipalOneIsForgotten) {
  Scene scene(Vector3::Zero());
  Body block = body("object", Box{{0.5, 0.3, 0.1}}, 2.0, Vector3::Zero(), Role::object);
  block.linear_factor = {1.0, 1.0, 0.0};
  block.angular_factor = Vector3::UnitZ();
  scene.add_body(block);
  BodyState tilted;
  tilted.orientation = turn(0.7, Vector3::UnitX());
  const State oblique = pack(scene, {{"object", tilted}});
  const Disturbance wrenches{{{0.1, 0.0, 0.0}, {0.0, 0.0, 0.02}}};
  World world(scene);
  const State flat = world.rollout_unchecked(pack(scene), wrenches, 60).state;
  const State leaning = world.rollout_unchecked(oblique, wrenches, 60).state;
  EXPECT_FALSE(same_bits(flat, leaning));
  EXPECT_TRUE(same_bits(world.rollout_unchecked(pack(scene), wrenches, 60).state, flat));
  EXPECT_TRUE(same_bits(World(scene).rollout_unchecked(oblique, wrenches, 60).state, leaning));
}

// ---- articulated bodies

// The hand with fingers of which the middle joints are followed by the last ones.
Scene coupled_hand() {
  const Scene plain = hand();
  Scene scene(plain.gravity(), plain.stepping());
  for (const Body& made : plain.bodies()) scene.add_body(made);
  for (Joint made : plain.joints()) {
    if (made.name == "left 3" || made.name == "right 3") {
      const std::string knuckle = made.name.substr(0, made.name.size() - 1) + "2";
      made.mimic = Mimic{knuckle, 0.5, -0.2 + 0.5 * 0.7};
      made.stiffness = made.damping = 0.0;
      made.lower = -infinity;
      made.upper = infinity;
      made.state = {};
    }
    scene.add_joint(made);
  }
  return scene;
}

TEST(HandPurity, RolloutsOfAHandWithFollowersShuffledGiveTheSameBits) {
  const Scene scene = coupled_hand();
  const std::vector<Question> asked = questions(scene, 300, 20);
  World world(scene);
  std::vector<std::size_t> order(asked.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::vector<Rollout> expected = answers(world, asked, order);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  EXPECT_EQ(differing(answers(world, asked, order), expected), 0) << "shuffled";
  World other(scene);
  EXPECT_EQ(differing(answers(other, asked, {order.rbegin(), order.rend()}), expected), 0) << "in another world";
}

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

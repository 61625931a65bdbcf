// Rollouts are pure functions: whatever the world was asked before, the same bits. In any order: determinism_test.cpp.

#include <gtest/gtest.h>

#include "rollouts.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// Questions, and what a world answers that was asked nothing else.
class Answered : public testing::Test {
 protected:
  Answered(const Scene& scene_, int count, unsigned int longest)
      : scene(scene_), asked(questions(scene, count, longest)), world(scene), expected(answers(world, asked)) {}

  Scene scene;
  std::vector<Question> asked;
  World world;
  std::vector<Rollout> expected;
};

class WorldPurity : public Answered {
 protected:
  WorldPurity() : Answered(crowded_push(), 300, 100) {}
};

TEST_F(WorldPurity, QuestionsTouchManyContacts) {
  int touching = 0;
  for (const Question& question : asked) touching += world.contacts(question.state).size() >= 8 ? 1 : 0;
  EXPECT_GT(touching, 200);
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

class CompoundPurity : public Answered {
 protected:
  CompoundPurity() : Answered(compounds(), 300, 40) {}
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
  const std::vector<Rollout> expected = answers(world, asked);
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

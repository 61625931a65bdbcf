// Rollouts are pure functions: whatever the world was asked before, the same bits. In any order: determinism_test.cpp.

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "random_mechanisms.hpp"
#include "step_parts.hpp"

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
    world.simulate(other.state, {0.0, {drive}}, 30, {7, 30});
    world.contacts(other.state);
    world.distance(other.state, "object", "effector");
    deepest_contact(world.scene(), other.state);
    const Rollout again = world.rollout_unchecked(asked[i].state, {push(asked[i].wrenches, asked[i].steps)});
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

TEST_F(WorldPurity, AnotherPlanIsFollowedForOneRollout) {
  Plan plan{scene.stepping().step};
  plan.wrenches.push_back({"effector", Wrenches::Constant(100, 6, 1.0)});
  Watch watch;
  watch.plan = &plan;
  World follows(scene, plan);
  for (std::size_t i = 0; i < asked.size(); i += 10) {
    const auto& [state, wrenches, steps] = asked[i];
    const Rollout other = world.rollout_unchecked(state, {push(wrenches, steps)}, {}, watch);
    EXPECT_TRUE(same_bits(other.state, follows.rollout_unchecked(state, {push(wrenches, steps)}).state))
        << "rollout " << i;
    EXPECT_FALSE(same_bits(other.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(world.rollout_unchecked(state, {push(wrenches, steps)}).state, expected[i].state))
        << "rollout " << i;
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
    world.simulate(other.state, {0.0, {steady("bowl", {0.5, 0.3, 1.0}, {0.01, 0.0, 0.0}, 20)}}, 20, {7, 20});
    world.contacts(other.state);
    world.distance(other.state, "bar", "angle");
    world.distance(other.state, "bowl", "ball");
    deepest_contact(world.scene(), other.state);
    const Rollout again = world.rollout_unchecked(asked[i].state, {push(asked[i].wrenches, asked[i].steps)});
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
  const State flat = world.rollout_unchecked(pack(scene), {push(wrenches, 60)}).state;
  const State leaning = world.rollout_unchecked(oblique, {push(wrenches, 60)}).state;
  EXPECT_FALSE(same_bits(flat, leaning));
  EXPECT_TRUE(same_bits(world.rollout_unchecked(pack(scene), {push(wrenches, 60)}).state, flat));
  EXPECT_TRUE(same_bits(World(scene).rollout_unchecked(oblique, {push(wrenches, 60)}).state, leaning));
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
  const Plan script{
      0.0, {steady("thumb 2", {0.2, 0.1, 0.3}, Vector3::Zero(), 10)}, {{"left 1", Eigen::VectorXd::Constant(10, 1.0)}}};
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const State& other = asked[(i + 7) % asked.size()].state;
    world.simulate(other, script, 10, {3, 10});
    world.contacts(other);
    world.distance(other, "object", "thumb 3");
    deepest_contact(world.scene(), other);
    const Rollout again = world.rollout_unchecked(asked[i].state, {push(asked[i].wrenches, asked[i].steps)});
    EXPECT_TRUE(same_bits(again.state, expected[i].state)) << "rollout " << i;
    EXPECT_TRUE(same_bits(again.effort, expected[i].effort)) << "rollout " << i;
  }
}

// ---- several trees, some bodies fast

constexpr std::uint64_t mechanisms = 8;
constexpr int of_a_mechanism = 40;
constexpr unsigned int longest_of_mechanisms = 8;  // steps

// What the tests below ask of one scene.
struct Mechanism {
  explicit Mechanism(std::uint64_t seed)
      : scene(random_mechanisms(seed)),
        asked(hurled_questions(scene, of_a_mechanism, longest_of_mechanisms)),
        world(scene),
        expected(answers(world, asked)) {}

  Rollout answer(std::size_t i) {
    return world.rollout_unchecked(asked[i].state, {push(asked[i].wrenches, asked[i].steps)});
  }

  Scene scene;
  std::vector<Question> asked;
  World world;
  std::vector<Rollout> expected;
};

// Asks for all rollouts again, each after a call of `before` with its mechanism and the rollout's number.
template <typename Before>
void expect_same_after(const Before& before) {
  for (std::uint64_t seed = 0; seed < mechanisms; ++seed) {
    Mechanism mechanism(seed);
    for (std::size_t i = 0; i < mechanism.asked.size(); ++i) {
      before(mechanism, i);
      const Rollout again = mechanism.answer(i);
      EXPECT_TRUE(same_bits(again.state, mechanism.expected[i].state)) << "seed " << seed << ", rollout " << i;
      EXPECT_TRUE(same_bits(again.effort, mechanism.expected[i].effort)) << "seed " << seed << ", rollout " << i;
    }
  }
}

int trees(const Scene& scene) {
  int count = 0;
  std::set<std::string> free_bases;
  for (const Joint& joint : scene.joints()) {
    if (scene.body(joint.parent).fixed()) ++count;
    if (!scene.body(joint.parent).fixed() && !scene.joint_to(scene.index(joint.parent)))
      free_bases.insert(joint.parent);
  }
  return count + static_cast<int>(free_bases.size());
}

TEST(MechanismPurity, QuestionsTouchLinksAndFastBodiesTakeTheirStepsInParts) {
  int parts = 0;
  int on_links = 0;
  int between_links = 0;
  for (std::uint64_t seed = 0; seed < mechanisms; ++seed) {
    const Scene scene = random_mechanisms(seed);
    EXPECT_GE(trees(scene), 2) << "seed " << seed;
    EXPECT_GT(deepest_contact(scene, pack(scene)).distance, -1e-3) << "seed " << seed;
    NativeEngine engine(scene);
    for (const Question& question : hurled_questions(scene, of_a_mechanism, longest_of_mechanisms)) {
      parts += cut_steps(engine, question.state, question.steps);
      for (const Contact& contact : engine.contacts()) {
        const auto link = [&](const std::string& name) { return scene.joint_to(scene.index(name)) ? 1 : 0; };
        const int links = link(contact.body_a) + link(contact.body_b);
        on_links += links > 0 && contact.normal_force > 0.01 ? 1 : 0;
        between_links += links == 2 && contact.normal_force > 0.01 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(parts, 50);
  EXPECT_GT(on_links, 200);
  EXPECT_GT(between_links, 3);
}

TEST(MechanismPurity, TwoEqualRolloutsInARowAreTheSameBits) {
  expect_same_after([](Mechanism& mechanism, std::size_t i) { mechanism.answer(i); });
}

TEST(MechanismPurity, RolloutsAfterTargetsDrivesAndOtherQuestionsGiveTheSameBits) {
  std::mt19937_64 random(3);
  expect_same_after([&](Mechanism& mechanism, std::size_t i) {
    const Scene& scene = mechanism.scene;
    Plan script{0.0,
                {steady("finger 2 2", {0.2, 0.1, 0.3}, Vector3::Zero(), 4),
                 steady("object", {0.0, 0.3, 0.2}, {0.001, 0.0, 0.0}, 4)},
                {}};
    for (const Joint& joint : scene.joints()) {
      if (!joint.moves() || joint.held) continue;
      script.targets.push_back({joint.name, Eigen::VectorXd::Constant(4, 0.5)});
      break;
    }
    const State other = hurled(scene, pack(scene), random);
    mechanism.world.simulate(other, script, 4, {1, 4});
    mechanism.world.contacts(other);
    mechanism.world.distance(other, "object", "finger 0 2");
    deepest_contact(mechanism.world.scene(), other);
    mechanism.world.rollout(other, mechanism.asked[i].wrenches, 1.0 / 240.0, true);
  });
}

// At 300 m/s bodies leave all others in a step, a mechanism that spins so fast may burst, and 1e306 m/s lead beyond all
// numbers.
TEST(MechanismPurity, RolloutsAfterOnesThatWentFarAwayOrDivergedGiveTheSameBits) {
  std::mt19937_64 random(4);
  int diverged = 0;
  expect_same_after([&](Mechanism& mechanism, std::size_t i) {
    if (i % 4 > 0) return;
    const Question& question = mechanism.asked[i];
    const State far = hurled(mechanism.scene, pack(mechanism.scene), random, 300.0, 300.0);
    const State farther = hurled(mechanism.scene, question.state, random, 1e306, 1e306);
    for (const State& state : {far, farther}) {
      try {
        mechanism.world.rollout_unchecked(state, {push(question.wrenches, 3)});
      } catch (const std::runtime_error&) {
        ++diverged;
      }
    }
  });
  EXPECT_GT(diverged, 0);
}

TEST(MechanismPurity, FreshWorldsGiveTheBitsOfUsedOnes) {
  expect_same_after([](Mechanism& mechanism, std::size_t i) {
    if (i % 4 == 0) mechanism.world = World(mechanism.scene);
  });
}

TEST(MechanismPurity, ContactsDistancesAndFramesOfUsedWorldsAreThoseOfFreshOnes) {
  std::mt19937_64 random(5);
  for (std::uint64_t seed = 0; seed < mechanisms; ++seed) {
    Mechanism mechanism(seed);
    const Scene& scene = mechanism.scene;
    for (int i = 0; i < 5; ++i) {
      mechanism.answer(static_cast<std::size_t>(i));
      const State state = hurled(scene, pack(scene), random);
      World fresh(scene);
      const std::vector<Contact> expected = fresh.contacts(state);
      const std::vector<Contact> contacts = mechanism.world.contacts(state);
      ASSERT_EQ(contacts.size(), expected.size()) << "seed " << seed;
      for (std::size_t j = 0; j < contacts.size(); ++j) {
        EXPECT_EQ(contacts[j].body_a + ", " + contacts[j].body_b, expected[j].body_a + ", " + expected[j].body_b);
        EXPECT_TRUE(same_bits(contacts[j].position, expected[j].position)) << "seed " << seed;
        EXPECT_TRUE(same_bits(contacts[j].normal_force, expected[j].normal_force)) << "seed " << seed;
      }
      EXPECT_TRUE(same_bits(mechanism.world.distance(state, "object", "finger 0 1"),
                            World(scene).distance(state, "object", "finger 0 1")));
      EXPECT_TRUE(
          same_bits(deepest_contact(mechanism.world.scene(), state).distance, deepest_contact(scene, state).distance));
      EXPECT_TRUE(same_bits(mechanism.world.simulate(state, {}, 4, {4}).front().state,
                            World(scene).simulate(state, {}, 4, {4}).front().state));
    }
  }
}

}  // namespace
}  // namespace energymargin

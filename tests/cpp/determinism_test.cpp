// The same bits in any order, in any world, on any thread.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <mutex>
#include <numeric>
#include <thread>

#include "random_mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr int threads = 4;
constexpr int worlds = 4;

// Answers in a random order, each in a random one of four worlds that four threads share.
std::vector<Rollout> shuffled_answers(const Scene& scene, const std::vector<Question>& asked) {
  std::mt19937 random(1);
  std::vector<std::size_t> order(asked.size());
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), random);
  std::vector<std::size_t> in_world(asked.size());
  for (std::size_t& world : in_world) world = random() % worlds;

  std::vector<World> shared;
  for (int i = 0; i < worlds; ++i) shared.emplace_back(scene);
  std::array<std::mutex, worlds> busy;
  std::vector<Rollout> rollouts(asked.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < order.size(); i = next++) {
      const Question& question = asked[order[i]];
      const std::lock_guard<std::mutex> lock(busy[in_world[i]]);
      rollouts[order[i]] =
          shared[in_world[i]].rollout_unchecked(question.state, {push(question.wrenches, question.steps)});
    }
  };
  std::vector<std::thread> pool;
  for (int i = 0; i < threads; ++i) pool.emplace_back(work);
  for (std::thread& thread : pool) thread.join();
  return rollouts;
}

TEST(Determinism, OfTenThousandRolloutsShuffledOverFourWorldsAndFourThreadsNoneDiffers) {
  struct Share {
    Scene scene;
    int rollouts;
    unsigned int longest;  // steps
  };
  int all = 0;
  for (const auto& [scene, rollouts, longest] : {Share{crowded_push(), 4000, 100}, Share{compounds(), 2000, 40},
                                                 Share{hand(), 2000, 20}, Share{coupled_hand(), 2000, 20}}) {
    const std::vector<Question> asked = questions(scene, rollouts, longest);
    World world(scene);
    EXPECT_EQ(differing(shuffled_answers(scene, asked), answers(world, asked)), 0);
    all += rollouts;
  }
  EXPECT_EQ(all, 10000);
}

// ENERGYMARGIN_ROLLOUTS asks for more of them than every run of the tests can pay for: docs/engineering/safety.md.
int mechanisms_rollouts() {
  const char* const asked = std::getenv("ENERGYMARGIN_ROLLOUTS");
  return asked ? std::stoi(asked) : 2000;
}

// In Bullet, which keeps more of the past than anything of ours: what of it a world forgets is in BulletEngine::forget.
TEST(Determinism, OfRolloutsInBulletShuffledOverWorldsAndThreadsNoneDiffers) {
  for (const Scene& native : {crowded_push(), compounds(), hand(), coupled_hand()}) {
    const Scene scene = native.with_engine(EngineKind::bullet);
    const std::vector<Question> asked = questions(scene, mechanisms_rollouts() / 20, 40);
    World world(scene);
    EXPECT_EQ(differing(shuffled_answers(scene, asked), answers(world, asked)), 0);
  }
}

TEST(Determinism, OfRolloutsOfRandomMechanismsShuffledOverWorldsAndThreadsNoneDiffers) {
  constexpr int of_a_scene = 100;
  constexpr unsigned int longest = 8;  // steps
  int all = 0;
  int different = 0;
  for (std::uint64_t seed = 0; all < mechanisms_rollouts(); ++seed, all += of_a_scene) {
    const Scene scene = random_mechanisms(seed);
    const std::vector<Question> asked = hurled_questions(scene, of_a_scene, longest);
    World world(scene);
    const int of_these = differing(shuffled_answers(scene, asked), answers(world, asked));
    EXPECT_EQ(of_these, 0) << "seed " << seed;
    different += of_these;
  }
  std::cout << different << " of " << all << " rollouts differ\n";
}

}  // namespace
}  // namespace energymargin

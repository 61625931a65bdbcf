#pragma once
// Many rollouts at once: each on a thread of a pool, or all together where a simulator plays them.

#include <optional>
#include <vector>

#include "base/thread_pool.hpp"
#include "energymargin/world.hpp"

namespace energymargin::search {

//! None for a rollout that diverged. `world(thread)` has the scene, and the plan of the robot.
template <typename WorldOf>
std::vector<std::optional<Rollout>> roll_out(const std::vector<RolloutQuestion>& questions, ThreadPool& pool,
                                             const WorldOf& world, const Limit& limit) {
  World& first = world(0);
  if (first.simulator()) return first.rollouts_unchecked(questions, limit);
  std::vector<std::optional<Rollout>> results(questions.size());
  pool.run(questions.size(), [&](std::size_t i, std::size_t thread) {
    const RolloutQuestion& question = questions[i];
    try {
      results[i] = world(thread).rollout_unchecked(question.state, question.pushes, limit, question.watch);
    } catch (const Diverged&) {
      results[i].reset();
    }
  });
  return results;
}

}  // namespace energymargin::search

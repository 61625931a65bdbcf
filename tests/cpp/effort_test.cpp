// Effort of escape.

#include "energymargin/metrics/effort.hpp"

#include <gtest/gtest.h>

#include "energymargin/membership.hpp"
#include "scenes.hpp"
#include "search_checks.hpp"

namespace energymargin {
namespace {

using namespace scenes;

class Effort : public testing::TestWithParam<std::string> {
 protected:
  static Escape escape(const Problem& problem, int nodes, std::uint64_t seed = 0) {
    return escape_effort(problem, {GetParam(), nodes, seed});
  }
};

INSTANTIATE_TEST_SUITE_P(Planner, Effort, testing::Values("est", "rrt"),
                         [](const auto& planner) { return planner.param; });

TEST_P(Effort, LiftingABlockOutCostsItsWeightTimesTheHeightAndLittleMore) {
  const double weight = 1.0 * g;
  for (const double height : {0.05, 0.2}) {
    const Escape found = escape(lift(height), 4000);
    EXPECT_GT(found.effort, weight * height - 1e-3);
    EXPECT_LT(found.effort, 1.5 * weight * height);
  }
}

TEST_P(Effort, MoreNodesNeverMakeItWorse) {
  const Escape few = escape(drift(), 200, 5);
  const Escape many = escape(drift(), 600, 5);
  EXPECT_LE(many.effort, few.effort);
  EXPECT_LT(many.effort, few.history.front().second);
}

TEST_P(Effort, EveryEdgeIsARolloutAndThePathReplaysToTheEscape) {
  for (const Effector effector : {Effector::drive, Effector::coast}) {
    Problem problem = push(effector);
    problem.captured = regions::Disc{"object", {1.0, 0.4}, 0.05};
    const Escape found = escape(problem, 400, 2);
    EXPECT_TRUE(found.tree.size() == 401 || found.effort == 0.0) << found.tree.size();
    ASSERT_LT(found.effort, infinity);
    expect_each_edge_is_a_rollout(found.tree, problem);
    expect_controls_within_bounds(found.tree, problem);
    expect_history_falls_to_the_effort(found);
    expect_path_leaves_the_capture_set_only_at_its_end(found, problem);
    expect_path_replays_from_its_controls(found, problem);
  }
}

TEST_P(Effort, RolloutsEndWhereTheirCostReachesTheBestEffortSoFar) {
  const Problem problem = drift();
  const Escape found = escape(problem, 400, 5);
  const Tree& tree = found.tree;
  World world(problem.scene);
  const EdgeStart edge_start(problem);
  auto best = found.history.begin();
  double bound = infinity;
  int ended = 0;
  for (int node = 1; node < tree.size(); ++node) {
    while (best != found.history.end() && best->first < node) bound = (best++)->second;
    if (tree.costs[node] < bound) continue;
    ++ended;
    const int from = tree.parents[node];
    const double shorter = tree.durations[node] - problem.scene.stepping().step;
    if (tree.costs[from] >= bound) {
      EXPECT_NEAR(shorter, 0.0, 1e-9) << "node " << node << " goes on from an escape's last coasting";
      continue;
    }
    const Rollout before = world.rollout(edge_start(tree.states.row(from)), control(tree, node), shorter);
    EXPECT_LT(tree.costs[from] + before.effort, bound) << "node " << node;
  }
  EXPECT_GT(ended, 0);
}

TEST_P(Effort, StoppedAtTheEscapeNoRolloutGoesOnOutside) {
  const Problem problem = push();
  EffortOptions stopping{GetParam(), 300, 2};
  stopping.stop_at_escape = true;
  const Escape found = escape_effort(problem, stopping);
  ASSERT_LT(found.effort, infinity);
  expect_each_edge_is_a_rollout(found.tree, problem);
  expect_history_falls_to_the_effort(found);
  expect_path_leaves_the_capture_set_only_at_its_end(found, problem);
  expect_path_replays_from_its_controls(found, problem);
  World world(problem.scene);
  const EdgeStart edge_start(problem);
  const Membership captured(problem.captured, problem.scene);
  const double look = 4.0 * problem.scene.stepping().step;
  int outside = 0;
  for (int node = 1; node < found.tree.size(); ++node) {
    const State start = edge_start(found.tree.states.row(found.tree.parents[node]));
    outside += captured(State(found.tree.states.row(node))) ? 0 : 1;
    for (double time = look; time < found.tree.durations[node] - 1e-9; time += look) {
      EXPECT_TRUE(captured(world.rollout(start, control(found.tree, node), time).state)) << "node " << node;
    }
  }
  EXPECT_GT(outside, 0);
}

TEST_P(Effort, PathStaysWithinTheBoundsAndNothingGrowsOutsideOfThem) {
  Problem problem = drift();
  problem.within = regions::HalfSpace{"object", Vector3::UnitX(), 0.005};
  const Escape found = escape(problem, 600, 1);
  ASSERT_LT(found.effort, infinity);
  expect_path_leaves_the_capture_set_only_at_its_end(found, problem);
  const Membership within(*problem.within, problem.scene);
  int outside = 0;
  for (int node = 1; node < found.tree.size(); ++node) {
    outside += within(State(found.tree.states.row(node))) ? 0 : 1;
    EXPECT_TRUE(within(State(found.tree.states.row(found.tree.parents[node])))) << "node " << node;
  }
  EXPECT_GT(outside, 0) << "the bounds were never met";
}

TEST_P(Effort, ClosedCageLetsNothingOut) {
  const Escape found = escape(closed_cage(), 300);
  EXPECT_EQ(found.effort, infinity);
  EXPECT_TRUE(found.history.empty());
  EXPECT_TRUE(found.path.empty());
  EXPECT_EQ(found.tree.size(), 301);
}

TEST_P(Effort, ObjectThatIsOutsideAlreadyNeedsNoEffort) {
  Problem problem = push();
  problem.captured = regions::Disc{"object", {9.0, 9.0}, 0.1};
  EXPECT_EQ(escape(problem, 100).effort, 0.0);
}

TEST_P(Effort, SameSeedGivesTheSameBitsAndAnotherSeedAnotherTree) {
  const Escape one = escape(lift(0.2), 200, 7);
  const Escape same = escape(lift(0.2), 200, 7);
  EXPECT_TRUE(same_bits(one.tree, same.tree));
  EXPECT_EQ(one.history, same.history);
  EXPECT_EQ(one.path, same.path);
  EXPECT_FALSE(same_bits(one.tree, escape(lift(0.2), 200, 8).tree));
}

TEST_P(Effort, StartOutsideOfTheBoundsIsRejected) {
  Problem problem = drift();
  problem.within = regions::Disc{"object", {9.0, 9.0}, 0.1};
  EXPECT_TRUE(rejects([&] { escape(problem, 50); }, {"within", "state"}));
}

TEST_P(Effort, TimeoutGivesTheBitsOfASearchOfSoManyNodes) {
  const Problem problem = lift(0.2);
  Escape timed;
  for (double timeout = 0.05; timed.nodes() < 1; timeout *= 2.0) {
    timed = escape_effort(problem, {GetParam(), 1000000, 3, Captured::all, Limit(nullptr, timeout)});
  }
  EXPECT_FALSE(timed.complete);
  ASSERT_LT(timed.nodes(), 1000000);
  const Escape whole = escape(problem, timed.nodes(), 3);
  EXPECT_TRUE(whole.complete);
  EXPECT_TRUE(same_bits(timed.tree, whole.tree));
  EXPECT_EQ(timed.history, whole.history);
  EXPECT_EQ(timed.path, whole.path);
}

TEST(EffortOptions, BadOptionsAndProblemsAreRejectedByNameAndValue) {
  EXPECT_TRUE(rejects([] { escape_effort(push(), {"sst", 10, 0}); }, {"planner", "'sst'", "'est' or 'rrt'"}));
  EXPECT_TRUE(rejects([] { escape_effort(push(), {"est", 0, 0}); }, {"nodes", "0", "at least 1"}));
  Problem problem = push();
  problem.state[0] = nan;
  EXPECT_TRUE(rejects([&] { escape_effort(problem); }, {"state", "'object'", "nan"}));
}

}  // namespace
}  // namespace energymargin

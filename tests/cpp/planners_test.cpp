// What holds for each of our planners, EST and RRT, with pruning.

#include "search/planners.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "scenes.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

template <typename Search>
Tree grow(const Problem& problem, std::uint64_t seed, int nodes = 150) {
  BoundedProblem bounded(problem, nullptr, nodes, seed);
  auto planner = planner_of<Search>(bounded, seed);
  planner.solve(bounded.termination());
  return bounded.take_tree();
}

template <typename Search>
class Planner : public testing::Test {};
using Searches = testing::Types<Est, Rrt>;
TYPED_TEST_SUITE(Planner, Searches);

TYPED_TEST(Planner, GrowsATreeOfRolloutsWithExactlyTheNodesAskedFor) {
  const Problem problem = push();
  const Tree tree = grow<TypeParam>(problem, 1);
  EXPECT_EQ(tree.size(), 151);
  expect_each_edge_is_a_rollout(tree, problem);
  expect_controls_within_bounds(tree, problem);
}

TYPED_TEST(Planner, SameSeedGivesTheSameBitsAndAnotherSeedAnotherTree) {
  EXPECT_TRUE(same_bits(grow<TypeParam>(push(), 1), grow<TypeParam>(push(), 1)));
  EXPECT_FALSE(same_bits(grow<TypeParam>(push(), 1), grow<TypeParam>(push(), 2)));
}

TYPED_TEST(Planner, SameSeedGivesTheSameBitsAlsoWhereManyNodesAreTheSameState) {
  // Most of these forces are below friction and leave the block exactly where it is.
  const Scene scene = rough_table();
  const Problem stuck = problem_of(scene, {5.0, 5.0, 0.0}, Vector3::Zero(), 0.3, regions::Disc{"object"});
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    EXPECT_TRUE(same_bits(grow<TypeParam>(stuck, seed, 600), grow<TypeParam>(stuck, seed, 600))) << "seed " << seed;
  }
}

TYPED_TEST(Planner, AfterPruningNothingGrowsFromANodeThatIsNotBelowTheBound) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, nullptr, 300, 4);
  auto planner = planner_of<TypeParam>(bounded, 4);
  const auto until = [&](int nodes) {
    return ompl::base::PlannerTerminationCondition([&bounded, nodes] { return bounded.nodes() >= nodes; });
  };
  planner.solve(until(100));
  // No cost but the root's is below: the rest of the tree hangs on what grows from it anew.
  const double bound = 1e-9;
  bounded.lower_bound(bound);
  planner.prune(bound);
  planner.solve(until(200));
  bounded.lower_bound(infinity);
  planner.solve(until(300));
  const Tree tree = bounded.take_tree();
  ASSERT_EQ(tree.size(), 301);
  for (int node = 101; node <= 300; ++node) {
    const int parent = tree.parents[node];
    EXPECT_TRUE(parent == 0 || parent > 200 || tree.costs[parent] < bound)
        << "node " << node << " grew from " << parent;
  }
}

}  // namespace
}  // namespace energymargin::search

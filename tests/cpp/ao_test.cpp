// AO-x over planners of our own and of OMPL's.

#include "energymargin/search/ao.hpp"

#include <gtest/gtest.h>
#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/util/Console.h>

#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

#include "scenes.hpp"
#include "search/planners.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

void expect_good_escape(const Escape& escape, const Problem& problem) {
  expect_each_edge_is_a_rollout(escape.tree, problem);
  expect_history_falls_to_the_effort(escape);
  expect_path_leaves_the_capture_set_only_at_its_end(escape, problem);
  expect_path_replays_from_its_controls(escape, problem);
}

TEST(Ao, OurPlannersImproveOnTheirFirstEscape) {
  const Problem problem = drift();
  BoundedProblem with_est(problem, &problem.captured, 500, 1);
  Est est(with_est, 1);
  const Escape by_est = ao(with_est, est);
  expect_good_escape(by_est, problem);
  EXPECT_GT(by_est.history.size(), 1u);
  BoundedProblem with_rrt(problem, &problem.captured, 500, 1);
  Rrt rrt(with_rrt);
  const Escape by_rrt = ao(with_rrt, rrt);
  expect_good_escape(by_rrt, problem);
  EXPECT_GT(by_rrt.history.size(), 1u);
}

TEST(Ao, BoundIsTheBestEffortInTheEnd) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 300, 2);
  Est est(bounded, 2);
  const Escape escape = ao(bounded, est);
  EXPECT_EQ(bounded.bound(), escape.effort);
}

TEST(Ao, WorksOverOmplsOwnRrtWhichCannotPrune) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 1000, 3);
  ompl::control::RRT rrt(bounded.space_information());
  rrt.setProblemDefinition(bounded.definition());
  rrt.setup();
  const Escape escape = ao(bounded, rrt);
  EXPECT_EQ(escape.tree.size(), 1001);
  expect_good_escape(escape, problem);
}

TEST(Ao, WorksOverOmplsKpieceWhichCannotPrune) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 1000, 3);
  ompl::control::KPIECE1 kpiece(bounded.space_information());
  kpiece.setProblemDefinition(bounded.definition());
  kpiece.setup();
  const Escape escape = ao(bounded, kpiece);
  EXPECT_EQ(escape.tree.size(), 1001);
  expect_good_escape(escape, problem);
}

template <typename Planner>
class OurPlanner : public ::testing::Test {};
using OurPlanners = ::testing::Types<Est, Rrt>;
TYPED_TEST_SUITE(OurPlanner, OurPlanners);

// An escape bounds the search before it is discarded, and no longer after that. Pruning takes with it what grew from
// it.
TYPED_TEST(OurPlanner, GrowsNothingFromWhatWasDiscarded) {
  const Problem problem = drift();
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    BoundedProblem bounded(problem, &problem.captured, 600, seed);
    auto planner = planner_of<TypeParam>(bounded, seed);
    std::vector<int> discarded;
    while (!bounded.spent()) {
      planner.solve(bounded.termination(bounded.nodes() + 50));
      for (int node = 1; node <= bounded.nodes(); ++node) {
        if (!bounded.escaped(node) || node % 3 == 0) continue;
        bounded.discard(node);
        discarded.push_back(node);
      }
      bounded.definition()->clearSolutionPaths();
      if (bounded.nodes() > 300) planner.prune(std::numeric_limits<double>::infinity());
    }
    ASSERT_FALSE(discarded.empty());
    std::map<int, int> children;
    const Tree tree = bounded.take_tree();
    for (int node = 1; node < tree.size(); ++node) ++children[tree.parents[node]];
    for (const int node : discarded) {
      for (int child = node + 1; child < tree.size(); ++child) {
        EXPECT_TRUE(tree.parents[child] != node || children[child] == 0) << node << " has a grandchild by " << child;
      }
    }
  }
}

TYPED_TEST(OurPlanner, EndsWithTheExceptionOfAPredicate) {
  Problem problem = drift();
  problem.captured = Region(regions::Predicate{[calls = 0](const States& states) mutable {
    if (++calls > 30) throw std::runtime_error("no answer");
    return Mask(Mask::Ones(states.rows()));
  }});
  BoundedProblem bounded(problem, &problem.captured, 600, 1);
  auto planner = planner_of<TypeParam>(bounded, 1);
  EXPECT_THROW(ao(bounded, planner), std::runtime_error);
}

TEST(Ao, LeavesTheLogLevelOfOmplAsItWas) {
  const ompl::msg::LogLevel before = ompl::msg::getLogLevel();
  ompl::msg::setLogLevel(ompl::msg::LOG_DEBUG);
  const Problem problem = drift();
  {
    const BoundedProblem one(problem, &problem.captured, 10, 1), other(problem, &problem.captured, 10, 1);
    EXPECT_EQ(ompl::msg::getLogLevel(), ompl::msg::LOG_ERROR);
  }
  EXPECT_EQ(ompl::msg::getLogLevel(), ompl::msg::LOG_DEBUG);
  ompl::msg::setLogLevel(before);
}

TEST(Ao, KeepsNoPathThatIsNone) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 300, 1);
  ompl::control::RRT rrt(bounded.space_information());
  rrt.setProblemDefinition(bounded.definition());
  rrt.setup();
  ao(bounded, rrt);
  EXPECT_EQ(bounded.definition()->getSolutionCount(), 0u);
}

TEST(Ao, StartOutsideOfTheCaptureSetIsAnEscapeWithoutEffortOrNodes) {
  Problem problem = drift();
  problem.captured = ~problem.captured;
  BoundedProblem bounded(problem, &problem.captured, 100, 0);
  Est est(bounded, 0);
  const Escape escape = ao(bounded, est);
  EXPECT_EQ(escape.effort, 0.0);
  EXPECT_EQ(escape.tree.size(), 1);
  EXPECT_EQ(escape.path, (std::vector<int>{0}));
  EXPECT_EQ(escape.history, (std::vector<std::pair<int, double>>{{0, 0.0}}));
}

TEST(Ao, CancelledBeforeTheFirstNodeGivesTheRootAlone) {
  const std::atomic<bool> cancel{true};
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 100, 0, Limit(&cancel));
  Est est(bounded, 0);
  const Escape escape = ao(bounded, est);
  EXPECT_FALSE(escape.complete);
  EXPECT_EQ(escape.nodes(), 0);
  EXPECT_TRUE(same_bits(State(escape.tree.states.row(0)), problem.state));
  EXPECT_EQ(escape.effort, infinity);
}

}  // namespace
}  // namespace energymargin::search

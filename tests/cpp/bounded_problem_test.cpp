// The feasible problem: its goal, its bound and its end.

#include "energymargin/search/bounded_problem.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "expect.hpp"
#include "quasistatic/barrier_problem.hpp"
#include "scenes.hpp"
#include "search/cost_space.hpp"
#include "search/planners.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

TEST(BoundedProblem, StateIsValidBelowTheBoundAndWithinTheBounds) {
  Problem problem = drift();
  problem.within = regions::Disc{"object", {0.0, 0.0}, 10.0};
  BoundedProblem bounded(problem, &problem.captured, 1, 0);
  CostSpace::StateType root;
  root.node = 0;
  EXPECT_TRUE(bounded.space_information()->isValid(&root));
  bounded.lower_bound(0.0);
  EXPECT_FALSE(bounded.space_information()->isValid(&root));
  bounded.lower_bound(1e-9);
  EXPECT_TRUE(bounded.space_information()->isValid(&root));
  problem.within = regions::Disc{"object", {100.0, 0.0}, 10.0};
  EXPECT_FALSE(BoundedProblem(problem, &problem.captured, 1, 0).space_information()->isValid(&root));
  EXPECT_TRUE(BoundedProblem(problem, nullptr, 1, 0).space_information()->isValid(&root));
}

TEST(BoundedProblem, GoalIsTheComplementOfTheCaptureSet) {
  Problem problem = drift();
  const auto start_is_goal = [&](const Region* captured) {
    BoundedProblem bounded(problem, captured, 1, 0);
    return bounded.definition()->getGoal()->isSatisfied(bounded.definition()->getStartState(0));
  };
  EXPECT_FALSE(start_is_goal(&problem.captured));
  problem.captured = ~problem.captured;
  EXPECT_TRUE(start_is_goal(&problem.captured));
  EXPECT_FALSE(start_is_goal(nullptr));
}

TEST(BoundedProblem, TheLimitEndsTheSearchBeforeItsNodesAreSpent) {
  std::atomic<bool> cancel{true};
  const Problem problem = drift();
  BoundedProblem bounded(problem, nullptr, 50, 0, Limit(&cancel));
  Est est(bounded, 0);
  est.solve(bounded.termination());
  EXPECT_TRUE(bounded.spent());
  EXPECT_FALSE(bounded.nodes_are_spent());
  EXPECT_EQ(bounded.nodes(), 0);
  cancel = false;
  est.solve(bounded.termination());
  EXPECT_TRUE(bounded.nodes_are_spent());
  EXPECT_EQ(bounded.take_tree().size(), 51);
}

template <typename Held>
constexpr bool stays_where_it_is = !std::is_copy_constructible_v<Held> && !std::is_move_constructible_v<Held> &&
                                   !std::is_copy_assignable_v<Held> && !std::is_move_assignable_v<Held>;

TEST(BoundedProblem, ProblemsToWhichOmplsCheckersReferAreNeitherCopiedNorMoved) {
  EXPECT_TRUE(stays_where_it_is<BoundedProblem>);
  EXPECT_TRUE(stays_where_it_is<quasistatic::BarrierProblem>);
}

TEST(BoundedProblem, NoNodesAreRejected) {
  EXPECT_TRUE(rejects([] { BoundedProblem(drift(), nullptr, 0, 0); }, {"nodes", "0", "at least 1"}));
}

}  // namespace
}  // namespace energymargin::search

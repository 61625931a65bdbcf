// Small changes that make an escape cheaper.

#include "search/shortening.hpp"

#include <gtest/gtest.h>

#include "energymargin/metrics/effort.hpp"
#include "scenes.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

Edge edge(const Eigen::Vector3d& force, int steps) {
  Edge made{Eigen::VectorXd::Zero(6), steps};
  made.wrenches.head<3>() = force;
  return made;
}

// A wasteful way out of the disc of `drift`: back and forth, and then out at full force.
int wasteful_escape(BoundedProblem& bounded) {
  int node = 0;
  for (const Edge& next : {edge({0.5, 0.5, 0.0}, 60), edge({-1.0, 0.0, 0.0}, 60), edge({1.0, -0.5, 0.0}, 30)}) {
    node = bounded.extend(node, next);
  }
  while (!bounded.escaped(node)) node = bounded.extend(node, edge({1.0, 0.0, 0.0}, 40));
  bounded.lower_bound(bounded.cost(node));
  return node;
}

TEST(Shortening, EachSuccessIsACheaperEscapeWithinTheBounds) {
  for (const int per_round : {1, 8}) {
    const Problem problem = drift();
    BoundedProblem bounded(problem, &problem.captured, 1500, 0);
    Shortening shortening(problem, bounded, 1);
    shortening.set_attempts_per_round(per_round);
    shortening.start(wasteful_escape(bounded));
    double best = bounded.bound();
    const double first = best;
    while (!bounded.spent()) {
      if (!shortening.attempt()) continue;
      EXPECT_LT(bounded.bound(), best);
      best = bounded.bound();
      EXPECT_EQ(bounded.cost(shortening.end()), best);
      EXPECT_TRUE(bounded.escaped(shortening.end()));
    }
    EXPECT_LT(best, 0.05 * first) << "without friction the least effort is as small as one likes";
    Escape escape;
    escape.path = bounded.path_to(shortening.end());
    escape.effort = best;
    escape.tree = bounded.take_tree();
    expect_each_edge_is_a_rollout(escape.tree, problem);
    expect_controls_within_bounds(escape.tree, problem);
    expect_path_leaves_the_capture_set_only_at_its_end(escape, problem);
    expect_path_replays_from_its_controls(escape, problem);
  }
}

TEST(Shortening, PathStaysWithinTheBoundsOfTheSearch) {
  Problem problem = drift();
  problem.within = regions::HalfSpace{"object", Vector3::UnitX(), 0.02};
  BoundedProblem bounded(problem, &problem.captured, 600, 0);
  int node = 0;
  while (!bounded.escaped(node)) node = bounded.extend(node, edge({-0.2, 1.0, 0.0}, 40));
  bounded.lower_bound(bounded.cost(node));
  Shortening shortening(problem, bounded, 2);
  shortening.start(node);
  while (!bounded.spent()) shortening.attempt();
  EXPECT_NE(shortening.end(), node);
  const std::vector<int> path = bounded.path_to(shortening.end());
  const Tree tree = bounded.take_tree();
  const Membership within(*problem.within, problem.scene);
  for (const int at : path) EXPECT_TRUE(within(State(tree.states.row(at)))) << "node " << at;
}

TEST(Shortening, BodyThatLeavesByItselfNeedsNoEffort) {
  Problem problem = drift();
  problem.state.segment<3>(7) = Vector3(0.3, 0.0, 0.0);  // its velocity
  for (const char* planner : {"est", "rrt"}) {
    EXPECT_EQ(escape_effort(problem, {planner, 300, 0, Captured::all, {}, energymargin::Search::improved}).effort, 0.0)
        << planner;
  }
}

TEST(Shortening, WaitFindsABodyThatLeavesAfterManyEdges) {
  Problem problem = drift();
  problem.state.segment<3>(7) = Vector3(0.06, 0.0, 0.0);  // its velocity
  BoundedProblem bounded(problem, &problem.captured, 100, 0);
  Shortening shortening(problem, bounded, 1);
  EXPECT_TRUE(shortening.wait());
  EXPECT_EQ(bounded.bound(), 0.0);
  EXPECT_GT(bounded.nodes(), 1);
  EXPECT_LE(bounded.nodes(), 10);
}

TEST(Shortening, WaitOfABodyAtRestEndsAtOnce) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 100, 0);
  Shortening shortening(problem, bounded, 1);
  EXPECT_FALSE(shortening.wait());
  EXPECT_EQ(bounded.nodes(), 1);
  EXPECT_TRUE(bounded.at_rest(1));
}

TEST(Shortening, LeadsOutWithoutAPlanner) {
  const Problem problem = drift();
  BoundedProblem bounded(problem, &problem.captured, 300, 0);
  Shortening shortening(problem, bounded, 1);
  while (!bounded.spent() && !shortening.attempt()) continue;
  EXPECT_TRUE(bounded.escaped(shortening.end()));
  EXPECT_EQ(bounded.cost(shortening.end()), bounded.bound());
}

TEST(Shortening, MakesTheEffortSmallerForTheSameNodes) {
  for (const char* planner : {"est", "rrt"}) {
    EffortOptions options{planner, 1000, 4};
    options.search = energymargin::Search::improved;
    const double with = escape_effort(lift(0.2), options).effort;
    options.shorten = false;
    EXPECT_LT(with, escape_effort(lift(0.2), options).effort) << planner;
  }
}

}  // namespace
}  // namespace energymargin::search

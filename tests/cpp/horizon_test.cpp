// Escapes within a horizon, against answers known on paper.

#include "search/horizon.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "scenes.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

constexpr double way = 0.2;          // m, to where it is out
constexpr double simulation = 0.99;  // of an answer on paper, what a simulation with steps gives away
const char* const planners[] = {"est", "rrt"};

// A body of 1 kg that moves along one axis alone and is out beyond `way`.
Problem along(const Vector3& axis, double force, double horizon, const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity);
  Body made = body("object", Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero(), Role::object);
  made.linear_factor = axis.cwiseAbs();
  made.angular_factor = Vector3::Zero();
  scene.add_body(made);
  Problem problem = problem_of(scene, force * axis, Vector3::Zero(), 0.3, regions::HalfSpace{"object", axis, way});
  problem.horizon = horizon;
  return problem;
}

// The same, thrown upwards: out from .1 s to .4077 s, when it is back at `way`.
Problem thrown(double horizon) {
  Problem problem = along(Vector3::UnitZ(), 20.0, horizon, {0.0, 0.0, -g});
  problem.state[9] = 2.0 + 0.5 * g * 0.1;  // m/s
  problem.check = 1.0 / 240.0;
  return problem;
}

// Work of pushing at once with all the force and then coasting, so that the body is out just in time; `against` is a
// force that brakes it all along. Nothing is cheaper: of all pushes that lead as far, the earliest leave the least
// speed.
double least_work(double force, double horizon, double against = 0.0) {
  const double impulse_time = horizon - std::sqrt(horizon * horizon * (1.0 - against / force) - 2.0 * way / force);
  const double speed = force * impulse_time - against * horizon;
  return 0.5 * speed * speed + against * way;
}

std::vector<double> efforts(const Problem& problem, const char* planner, int nodes = 2000, int seeds = 5) {
  std::vector<double> found;
  for (int seed = 0; seed < seeds; ++seed) {
    found.push_back(escape_effort(problem, {planner, nodes, static_cast<std::uint64_t>(seed)}).effort);
  }
  std::sort(found.begin(), found.end());
  return found;
}

void expect_near(const Problem& problem, double answer, const std::string& name) {
  for (const char* planner : planners) {
    const std::vector<double> found = efforts(problem, planner);
    EXPECT_GE(found.front(), simulation * answer) << name << ", " << planner;
    EXPECT_LE(found[found.size() / 2], 1.1 * answer) << name << ", " << planner;
  }
}

TEST(Horizon, LeastWorkIsThatOfAFullPushAtOnce) {
  for (const double force : {0.5, 1.0, 3.0}) {
    expect_near(along(Vector3::UnitX(), force, 1.0), least_work(force, 1.0), std::to_string(force) + " N");
  }
}

TEST(Horizon, LessTimeTakesMoreWork) {
  expect_near(along(Vector3::UnitX(), 3.0, 0.75), least_work(3.0, 0.75), "three quarters of a second");
  EXPECT_GT(least_work(3.0, 0.75), 1.5 * least_work(3.0, 1.0));
}

TEST(Horizon, GravityTakesItsShareOfTheTime) {
  expect_near(along(Vector3::UnitZ(), 20.0, 0.25, {0.0, 0.0, -g}), least_work(20.0, 0.25, g), "lifted");
}

TEST(Horizon, ForcesThatAreTooWeakForTheTimeFindNoEscape) {
  for (const char* planner : planners) {
    EXPECT_EQ(escape_effort(along(Vector3::UnitX(), 0.39, 1.0), {planner, 500, 0}).effort, infinity);
    EXPECT_LT(escape_effort(along(Vector3::UnitX(), 0.39, 2.0), {planner, 500, 0}).effort, infinity);
  }
}

TEST(Horizon, WhatLeavesByItselfNeedsNoEffortWhateverTheNodes) {
  Problem problem = along(-Vector3::UnitZ(), 1.0, 0.5, {0.0, 0.0, -g});
  problem.force = Vector3::UnitZ();
  for (const char* planner : planners) {
    const Escape escape = escape_effort(problem, {planner, 1, 0});
    EXPECT_EQ(escape.effort, 0.0);
    EXPECT_TRUE(escape.complete);
    ASSERT_EQ(escape.path.size(), 2U);
    EXPECT_EQ(escape.nodes(), 0);
    EXPECT_TRUE(escape.tree.controls.isZero(0.0));
    EXPECT_NEAR(escape.tree.times()[1], std::sqrt(2.0 * way / g), 1.0 / 60.0) << "at the next look";
  }
  problem.horizon = 44.0 / 240.0;
  EXPECT_GT(escape_effort(problem, {"est", 100, 0}).effort, 0.0);
}

TEST(Horizon, AnExitThatIsTakenBackBeforeTheDwellIsOverIsNone) {
  Problem problem = thrown(1.0);
  const double outside = 2.0 * (2.0 - 0.5 * g * 0.1) / g;  // s
  problem.dwell = 65.0 / 240.0;
  ASSERT_LT(problem.dwell, outside);
  EXPECT_EQ(escape_effort(problem, {"est", 1, 0}).effort, 0.0);
  problem.dwell = 80.0 / 240.0;
  ASSERT_GT(problem.dwell, outside);
  const double effort = escape_effort(problem, {"est", 500, 0}).effort;
  EXPECT_GT(effort, 0.0);
  EXPECT_LT(effort, infinity);
  problem.horizon = 90.0 / 240.0;  // it is still outside
  EXPECT_EQ(escape_effort(problem, {"est", 1, 0}).effort, 0.0);
}

TEST(Horizon, OnlyLooksCount) {
  Problem problem = thrown(1.0);
  problem.check = 1.0;
  EXPECT_GT(escape_effort(problem, {"est", 1, 0}).effort, 0.0);
  problem.horizon = 0.4;
  EXPECT_EQ(escape_effort(problem, {"est", 1, 0}).effort, 0.0) << "the horizon is a look";
}

// A hand without gravity, with a body in it, that goes away with a plan.
Problem carried(double speed, double horizon) {
  Scene scene = free_body(Box{{0.1, 0.1, 0.1}}, 1.0);
  scene.add_body(body("hand", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.0, 0.3}, Role::effector));
  Problem problem =
      problem_of(scene, {3.0, 0.0, 0.0}, Vector3::Zero(), 0.3, regions::Ball{"object", {0.0, 0.0, -0.3}, 0.2, "hand"});
  Wrenches velocities = Wrenches::Zero(240, 6);
  velocities.col(0).setConstant(speed);
  problem.plan = Plan{1.0 / 240.0, {}, {}, {{"hand", velocities, 1000.0}}};
  problem.horizon = horizon;
  return problem;
}

TEST(Horizon, APlanThatGoesAwayLeavesTheObjectBehind) {
  const Escape escape = escape_effort(carried(0.5, 1.0), {"est", 1, 0});
  EXPECT_EQ(escape.effort, 0.0);
  EXPECT_EQ(escape.path.size(), 2U);
  EXPECT_NEAR(escape.tree.times()[1], 0.4, 1.1 / 60.0);
}

TEST(Horizon, APlanIsFollowedFromTheTimeOfEachNodeOn) {
  const Problem problem = carried(0.15, 1.0);
  for (const char* planner : planners) {
    const Escape escape = escape_effort(problem, {planner, 300, 1});
    const Tree& tree = escape.tree;
    const Eigen::VectorXd times = tree.times();
    World world(problem.scene, *problem.plan);
    int parents_at_the_end = 0;
    for (int node = 1; node < tree.size(); ++node) {
      const int parent = tree.parents[node];
      Watch watch;
      watch.first = static_cast<int>(std::lround(240.0 * times[parent]));
      const int steps = static_cast<int>(std::lround(240.0 * tree.durations[node]));
      const Rollout rollout =
          world.rollout_unchecked(tree.states.row(parent), {push(control(tree, node), steps)}, {}, watch);
      EXPECT_TRUE(same_bits(rollout.state, State(tree.states.row(node)))) << "node " << node;
      EXPECT_LE(times[node], 1.0 + 1e-9);
      parents_at_the_end += times[parent] > 1.0 - 1e-9 ? 1 : 0;
    }
    EXPECT_EQ(parents_at_the_end, 0);
    EXPECT_NEAR(times[1], 1.0, 1e-9) << "the undisturbed future comes first";
    EXPECT_GT(escape.effort, 0.0);
    EXPECT_EQ(escape.discarded, 0) << "the finer simulation follows the plan too";
  }
}

TEST(Horizon, OfSeveralObjectsTheOneIsPushedThatTakesTheLeastWork) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    Body made = body("body " + std::to_string(i), Box{{0.1, 0.1, 0.1}}, 1.0 + i, {0.0, i * 1.0, 0.0}, Role::object);
    made.linear_factor = Vector3::UnitX();
    made.angular_factor = Vector3::Zero();
    scene.add_body(made);
  }
  Region captured = regions::HalfSpace{"body 0", Vector3::UnitX(), way};
  for (int i = 1; i < 3; ++i)
    captured = captured & Region(regions::HalfSpace{"body " + std::to_string(i), Vector3::UnitX(), way});
  Problem problem = problem_of(scene, {3.0, 0.0, 0.0}, Vector3::Zero(), 0.3, captured);
  problem.horizon = 1.0;
  expect_near(problem, least_work(3.0, 1.0), "three bodies");
}

TEST(Horizon, ADrivenEffectorNeedsNoPlan) {
  Problem problem = push(Effector::drive);
  problem.horizon = 1.0;
  const Escape escape = escape_effort(problem, {"est", 200, 0});
  EXPECT_LE(escape.tree.times().maxCoeff(), 1.0 + 1e-9);
}

TEST(Horizon, ASearchThatIsCutShortIsOneOfFewerNodes) {
  const Problem problem = along(Vector3::UnitX(), 1.0, 1.0);
  const Escape few = escape_effort(problem, {"est", 60, 3});
  const Escape many = escape_effort(problem, {"est", 200, 3});
  EXPECT_EQ(few.nodes(), 60);
  EXPECT_TRUE(same_bits(few.tree.states, States(many.tree.states.topRows(few.tree.size()))));
}

}  // namespace
}  // namespace energymargin::search

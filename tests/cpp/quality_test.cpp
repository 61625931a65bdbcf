// Results tell how many of their steps did not converge, and how much time was lost.

#include <gtest/gtest.h>

#include <algorithm>

#include "energymargin/batch.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/rare.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

// Ten bricks on top of each other, of which the uppermost is the object.
Scene tower(int iterations) {
  Stepping stepping;
  stepping.iterations = iterations;
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("table", Plane{}));
  for (int i = 0; i < 10; ++i) {
    const Role role = i == 9 ? Role::object : Role::none;
    scene.add_body(body("brick " + std::to_string(i), Box{{0.1, 0.1, 0.04}}, 0.5, {0.0, 0.0, 0.02 + 0.04 * i}, role));
  }
  return scene;
}

Problem tower_problem(int iterations) {
  return problem_of(tower(iterations), {2.0, 2.0, 0.0}, Vector3::Zero(), 0.1,
                    regions::Ball{"brick 9", {0.0, 0.0, 0.38}, 0.05});
}

Problem with_horizon(Problem problem) {
  problem.horizon = 0.1;
  return problem;
}

// A block between two bodies that nothing stops, and that drive into it.
Scene press() {
  Scene scene(Vector3::Zero());
  scene.add_body(body("object", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.002, 0.0}, Role::object));
  for (const double side : {-1.0, 1.0}) {
    Body jaw = body(side < 0.0 ? "left" : "right", Box{{0.1, 0.1, 0.1}}, 1.0, {0.105 * side, 0.0, 0.0});
    jaw.kinematic = true;
    jaw.state.velocity = {-0.3 * side, 0.0, 0.0};
    scene.add_body(jaw);
  }
  return scene;
}

Rollout alone(const Scene& scene, double duration) { return World(scene).rollout(pack(scene), {Wrench{}}, duration); }

StepCounts counts(long long steps, long long unconverged, double lost_time = 0.0) {
  StepCounts counts;
  counts.steps = steps;
  counts.unconverged = unconverged;
  counts.lost_time = lost_time;
  return counts;
}

void expect_same(const StepCounts& one, const StepCounts& other) {
  EXPECT_EQ(one.steps, other.steps);
  EXPECT_EQ(one.unconverged, other.unconverged);
  EXPECT_EQ(one.lost_time, other.lost_time);
}

bool warns_of(const std::vector<Warning>& warnings, const std::string& about) {
  return std::any_of(warnings.begin(), warnings.end(), [&](const Warning& warning) { return warning.about == about; });
}

// ---- one simulation

TEST(Quality, SolverOfTooFewIterationsDoesNotConverge) {
  const Scene scene = tower(1);
  const Rollout rollout = World(scene).rollout(pack(scene), {Wrench{{2.0, 2.0, 0.0}, Vector3::Zero()}}, 0.25);
  EXPECT_GT(rollout.unconverged, 30);
  EXPECT_LE(rollout.unconverged, rollout.steps);
  EXPECT_EQ(rollout.lost_time, 0.0);
}

TEST(Quality, BodyInFreeFlightConvergesAndLosesNothing) {
  const Rollout rollout = alone(free_body(), 0.25);
  EXPECT_EQ(rollout.steps, 60);
  EXPECT_EQ(rollout.unconverged, 0);
  EXPECT_EQ(rollout.lost_time, 0.0);
}

TEST(Quality, TimeIsLostBetweenBodiesThatNothingStops) {
  const Rollout rollout = alone(press(), 0.25);
  EXPECT_GT(rollout.lost_time, 0.08);
  EXPECT_LE(rollout.lost_time, 0.25 + 1e-9);
}

TEST(Quality, SimulationTellsUntilEachFrameWhatARolloutTells) {
  for (const Scene& scene : {tower(1), press()}) {
    const std::vector<Frame> frames = World(scene).simulate(pack(scene), {}, 60, {0, 20, 60});
    const Rollout rollout = alone(scene, 0.25);
    EXPECT_EQ(frames[0].unconverged, 0);
    EXPECT_LE(frames[1].unconverged, frames[2].unconverged);
    EXPECT_EQ(frames[2].unconverged, rollout.unconverged);
    EXPECT_NEAR(frames[2].lost_time, rollout.lost_time, 1e-12);
  }
}

// ---- sums

TEST(Quality, CaptureScoreSumsUpItsTreesOnAnyNumberOfThreads) {
  CaptureOptions options;
  options.nodes = 20;
  options.trees = 3;
  const CaptureScore one = capture_score(tower_problem(1), options);
  options.threads = 3;
  EXPECT_GT(one.unconverged, 0);
  EXPECT_EQ(one.steps, [&] {
    double time = 0.0;
    for (const Tree& tree : one.trees) time += tree.durations.sum();
    return std::llround(time / step);
  }());
  expect_same(one, capture_score(tower_problem(1), options));
}

TEST(Quality, ProbabilitySumsUpItsRolloutsOnAnyNumberOfThreads) {
  ProbabilityOptions options;
  options.rollouts = 8;
  const CaptureProbability one = capture_probability(with_horizon(tower_problem(1)), options);
  options.threads = 3;
  EXPECT_GT(one.unconverged, 0);
  expect_same(one, capture_probability(with_horizon(tower_problem(1)), options));
}

TEST(Quality, RareLossesSumUpTheirReplicasOnAnyNumberOfThreads) {
  RareOptions options;
  options.rollouts = fewest_replicas;
  const CaptureProbability one = rare_capture_probability(with_horizon(tower_problem(1)), options);
  options.threads = 3;
  EXPECT_GT(one.unconverged, 0);
  EXPECT_LE(one.unconverged, one.steps);
  expect_same(one, rare_capture_probability(with_horizon(tower_problem(1)), options));
}

TEST(Quality, EffortSumsUpTheRolloutsOfItsTree) {
  EffortOptions options;
  options.nodes = 50;
  const Escape escape = escape_effort(tower_problem(1), options);
  EXPECT_GT(escape.unconverged, 0);
  EXPECT_EQ(escape.steps, std::llround(escape.tree.durations.sum() / step));
}

TEST(Quality, StepsThatTellWhetherAnExitLastsCountToo) {
  Problem problem = with_horizon(
      problem_of(free_body(), {50.0, 0.0, 0.0}, Vector3::Zero(), 0.1, regions::Ball{"object", Vector3::Zero(), 0.01}));
  problem.dwell = 6 * step;
  EffortOptions options;
  options.nodes = 30;
  const Escape escape = escape_effort(problem, options);
  EXPECT_GT(escape.steps, std::llround(escape.tree.durations.sum() / step));
}

TEST(Quality, RowOfABatchSumsUpItsSearches) {
  BatchOptions options;
  options.metrics = {"effort/est", "capture"};
  options.nodes = 20;
  const ScoreRow both = score(tower_problem(1), 0, options);
  options.metrics = {"effort/est"};
  StepCounts sum = score(tower_problem(1), 0, options);
  options.metrics = {"capture"};
  sum += score(tower_problem(1), 0, options);
  expect_same(both, sum);
}

// ---- warnings

TEST(Quality, MoreThanAHundredthOfTheStepsOrOfTheTimeIsWarnedOf) {
  EXPECT_TRUE(implausible(counts(1000, 10, 0.01), 1.0).empty());
  EXPECT_TRUE(implausible(counts(0, 0), 0.0).empty());
  const std::vector<Warning> warnings = implausible(counts(1000, 11), 1.0);
  ASSERT_EQ(warnings.size(), 1u);
  for (const char* word : {"1.1 %", "1000 steps", "solver_iterations", "step", "squeezed", "contact.md"}) {
    EXPECT_NE(warnings[0].text.find(word), std::string::npos) << warnings[0].text;
  }
  const std::vector<Warning> lost = implausible(counts(1000, 0, 0.02), 1.0);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_NE(lost[0].text.find("2 % of 1 s"), std::string::npos) << lost[0].text;
}

TEST(Quality, ResultsHaveTheWarningsOfTheirSteps) {
  EffortOptions effort;
  effort.nodes = 20;
  EXPECT_TRUE(warns_of(escape_effort(tower_problem(1), effort).warnings, "steps that did not converge"));
  CaptureOptions capture;
  capture.nodes = 20;
  EXPECT_TRUE(warns_of(capture_score(tower_problem(1), capture).warnings, "steps that did not converge"));
  ProbabilityOptions probability;
  probability.rollouts = 5;
  EXPECT_TRUE(warns_of(capture_probability(with_horizon(tower_problem(1)), probability).warnings,
                       "steps that did not converge"));
}

// A search that never waits finds efforts above 0 for what falls out by itself.
TEST(Quality, EffortOfWhatLeavesByItselfIsContradicted) {
  const Problem falls = problem_of(free_body(Sphere{0.05}, 1.0, {0.0, 0.0, -g}), {50.0, 50.0, 50.0}, Vector3::Zero(),
                                   0.5, regions::Ball{"object", Vector3::Zero(), 0.5});
  EffortOptions options;
  options.nodes = 50;
  options.check_undisturbed = true;
  options.search = Search::published;
  const Escape escape = escape_effort(falls, options);
  EXPECT_GT(escape.effort, 0.0);
  ASSERT_TRUE(escape.undisturbed_exit);
  EXPECT_NEAR(*escape.undisturbed_exit, 20.0 / 60.0, 1e-9);
  EXPECT_TRUE(warns_of(escape.warnings, "escape_effort: undisturbed"));
  options.search = Search::improved;
  const Escape waits = escape_effort(falls, options);
  EXPECT_EQ(waits.effort, 0.0);
  EXPECT_TRUE(waits.warnings.empty());
}

TEST(Quality, EffortAboveThatOfADiscardedEscapeIsContradicted) {
  const Problem problem = lift(0.1);
  Escape escape;
  escape.effort = infinity;
  EXPECT_TRUE(implausible(escape, problem).empty());
  escape.discarded = 2;
  escape.discarded_effort = 0.5;
  const std::vector<Warning> warnings = implausible(escape, problem);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].about, "escape_effort: discarded");
  for (const char* word : {"inf J", "0.5 J", "2 were discarded"}) {
    EXPECT_NE(warnings[0].text.find(word), std::string::npos) << warnings[0].text;
  }
  escape.effort = 0.4;  // a cheaper one was found
  EXPECT_TRUE(implausible(escape, problem).empty());
}

}  // namespace
}  // namespace energymargin

// Capture and success score.

#include "energymargin/metrics/capture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "energymargin/membership.hpp"
#include "energymargin/random.hpp"
#include "scenes.hpp"
#include "search_checks.hpp"

namespace energymargin {
namespace {

using namespace scenes;

CaptureOptions options(int nodes, std::uint64_t seed = 0, int trees = 1, int threads = 1) {
  CaptureOptions made;
  made.nodes = nodes;
  made.seed = seed;
  made.trees = trees;
  made.threads = threads;
  return made;
}

TEST(Likelihoods, AddUpToOneForAnyCostsAndRate) {
  std::mt19937 random(1);
  for (const double scale : {0.0, 1.0, 1e6}) {
    for (const double rate : {0.0, 5.0, 1e6}) {
      std::uniform_real_distribution<double> cost(scale, 2.0 * scale);
      const Eigen::VectorXd costs = Eigen::VectorXd::NullaryExpr(1001, [&] { return cost(random); });
      const Eigen::VectorXd likelihood = likelihoods(costs, rate);
      EXPECT_NEAR(likelihood.sum(), 1.0, 1e-12) << "costs " << scale << ", rate " << rate;
      EXPECT_GE(likelihood.minCoeff(), 0.0);
    }
  }
}

TEST(Likelihoods, FallByTheExponentialOfTheRateTimesTheCost) {
  const Eigen::VectorXd likelihood = likelihoods(Eigen::Vector3d(0.0, 0.2, 1.0), 5.0);
  EXPECT_NEAR(likelihood[1] / likelihood[0], std::exp(-1.0), 1e-15);
  EXPECT_NEAR(likelihood[2] / likelihood[0], std::exp(-5.0), 1e-15);
}

TEST(Capture, ScoresAreTheLikelihoodsOfTheNodesInEachSet) {
  const Problem problem = push();
  const CaptureScore score = capture_score(problem, options(300));
  const Tree& tree = score.trees.front();
  const Membership captured(problem.captured, problem.scene);
  const Membership succeeded(*problem.succeeded, problem.scene);
  double inside = 0.0, success = 0.0, all = 0.0;
  for (int node = 0; node < tree.size(); ++node) {
    const double weight = std::exp(-5.0 * tree.costs[node]);
    all += weight;
    if (captured(State(tree.states.row(node)))) inside += weight;
    if (succeeded(State(tree.states.row(node)))) success += weight;
  }
  EXPECT_NEAR(score.capture.mean, inside / all, 1e-12);
  EXPECT_NEAR(score.success->mean, success / all, 1e-12);
  EXPECT_GT(score.capture.mean, 0.0);
  EXPECT_LT(score.capture.mean, 1.0);
  EXPECT_GT(score.success->mean, 0.0);
  EXPECT_LT(score.success->mean, 1.0);
  EXPECT_TRUE(score.likelihoods.isApprox(likelihoods(tree.costs, 5.0), 1e-15));
}

TEST(Capture, TreeHasTheNodesAskedForAndEachEdgeIsARollout) {
  const Problem problem = push(Effector::coast);
  const CaptureScore score = capture_score(problem, options(200));
  ASSERT_EQ(score.trees.size(), 1u);
  EXPECT_EQ(score.trees.front().size(), 201);
  expect_each_edge_is_a_rollout(score.trees.front(), problem);
  expect_controls_within_bounds(score.trees.front(), problem);
}

// Simulation steps of each rollout of a tree, by its last node: the others are on its way.
std::vector<std::pair<int, int>> rollouts_and_nodes(const Tree& tree, double step) {
  std::vector<std::pair<int, int>> rollouts;
  for (int node = 1; node < tree.size(); ++node) {
    const bool goes_on = node > 1 && tree.parents[node] == tree.parents[node - 1] &&
                         tree.controls.row(node) == tree.controls.row(node - 1);
    if (!goes_on) rollouts.emplace_back(0, 0);
    rollouts.back().first = static_cast<int>(std::lround(tree.durations[node] / step));
    ++rollouts.back().second;
  }
  return rollouts;
}

TEST(Capture, StatesOnTheWayAreNodesOfATreeThatGrowsAsWithout) {
  const Problem problem = push();
  CaptureOptions several = options(202, 1);
  several.nodes_per_edge = 4;
  const CaptureScore score = capture_score(problem, several);
  const Tree& tree = score.trees.front();
  EXPECT_EQ(score.nodes(), 202);
  expect_each_edge_is_a_rollout(tree, problem);
  expect_controls_within_bounds(tree, problem);
  const auto rollouts = rollouts_and_nodes(tree, problem.scene.stepping().step);
  int nodes = 0;
  for (const auto& [steps, count] : rollouts) {
    const int left = 202 - nodes;
    EXPECT_EQ(count, std::min({4, steps, left}));
    nodes += count;
  }
  const CaptureScore plain = capture_score(problem, options(static_cast<int>(rollouts.size()) - 1, 1));
  int end = 0;
  for (std::size_t i = 0; i + 1 < rollouts.size(); ++i) {
    end += rollouts[i].second;
    const int same = static_cast<int>(i) + 1;
    EXPECT_TRUE(same_bits(State(tree.states.row(end)), State(plain.trees.front().states.row(same)))) << "rollout " << i;
    EXPECT_EQ(tree.costs[end], plain.trees.front().costs[same]);
  }
}

CaptureOptions in_rounds(int nodes_per_round, int nodes, int threads = 1) {
  CaptureOptions made = options(nodes, 3, 1, threads);
  made.nodes_per_round = nodes_per_round;
  return made;
}

TEST(Capture, NodesOfARoundGrowFromTheTreeBeforeIt) {
  const Problem problem = push();
  const Tree tree = capture_score(problem, in_rounds(16, 100)).trees.front();
  ASSERT_EQ(tree.size(), 101);
  expect_each_edge_is_a_rollout(tree, problem);
  expect_controls_within_bounds(tree, problem);
  // The rounds are of 1, 2, 4, 8 and 16 nodes, and then of 16 each.
  for (const int first : {1, 2, 4, 8, 16, 32, 48, 64, 80, 96}) {
    const int last = std::min({2 * first - 1, first + 15, 100});
    for (int node = first; node <= last; ++node) EXPECT_LT(tree.parents[node], first) << "node " << node;
  }
}

TEST(Capture, RoundsGiveTheSameBitsOnAnyNumberOfThreadsAndForSeveralTrees) {
  CaptureOptions several = in_rounds(16, 100);
  several.nodes_per_edge = 3;
  several.trees = 2;
  for (const CaptureOptions& asked : {in_rounds(16, 100), in_rounds(1000, 100), several}) {
    const CaptureScore one = capture_score(push(), asked);
    EXPECT_EQ(one.nodes(), 100);
    for (const int threads : {2, 5}) {
      CaptureOptions threaded = asked;
      threaded.threads = threads;
      const CaptureScore other = capture_score(push(), threaded);
      EXPECT_TRUE(same_bits(other.capture.mean, one.capture.mean)) << threads << " threads";
      for (std::size_t i = 0; i < one.trees.size(); ++i) EXPECT_TRUE(same_bits(other.trees[i], one.trees[i]));
    }
  }
}

TEST(Capture, CountsTheNodesOfRounds) {
  std::atomic<int> count{0};
  CaptureOptions counted = in_rounds(16, 100, 2);
  counted.node_counter = &count;
  capture_score(push(), counted);
  EXPECT_EQ(count, 100);
}

TEST(Capture, RateOfZeroGivesThePlainFractionOfNodes) {
  const Problem problem = push();
  CaptureOptions even = options(200);
  even.rate = 0.0;
  const CaptureScore score = capture_score(problem, even);
  const auto inside = Membership(problem.captured, problem.scene)(score.trees.front().states).count();
  EXPECT_NEAR(score.capture.mean, static_cast<double>(inside) / 201.0, 1e-12);
}

TEST(Capture, RateOfTheOptionsGoesBeforeTheProblems) {
  Problem problem = push();
  CaptureOptions options_rate = options(100);
  options_rate.rate = 1.5;
  const double given = capture_score(problem, options_rate).capture.mean;
  EXPECT_NE(given, capture_score(problem, options(100)).capture.mean);
  problem.rate = 1.5;
  EXPECT_EQ(given, capture_score(problem, options(100)).capture.mean);
}

TEST(Capture, ClosedCageCapturesExactly) {
  EXPECT_EQ(capture_score(closed_cage(), options(300, 1, 3)).capture.mean, 1.0);
}

TEST(Capture, ComplementaryCaptureSetsShareTheLikelihood) {
  Problem problem = push();
  const double inside = capture_score(problem, options(200)).capture.mean;
  problem.captured = ~problem.captured;
  EXPECT_NEAR(inside + capture_score(problem, options(200)).capture.mean, 1.0, 1e-12);
}

TEST(Capture, OneTwoAndFourThreadsGiveTheSameBits) {
  const CaptureScore one = capture_score(push(), options(60, 3, 5, 1));
  for (const int threads : {2, 4}) {
    const CaptureScore other = capture_score(push(), options(60, 3, 5, threads));
    EXPECT_TRUE(same_bits(other.capture.mean, one.capture.mean));
    EXPECT_TRUE(same_bits(other.success->mean, one.success->mean));
    EXPECT_TRUE(same_bits(*other.capture.standard_error, *one.capture.standard_error));
    for (std::size_t i = 0; i < 5; ++i) EXPECT_TRUE(same_bits(other.trees[i], one.trees[i])) << "tree " << i;
  }
}

TEST(Capture, SeveralTreesGiveTheirMeanAndItsStandardError) {
  const Problem problem = push();
  const CaptureScore score = capture_score(problem, options(60, 3, 4));
  Eigen::Vector4d each;
  for (int i = 0; i < 4; ++i) {
    const Tree& tree = score.trees[static_cast<std::size_t>(i)];
    const Mask inside = Membership(problem.captured, problem.scene)(tree.states);
    each[i] = inside.select(likelihoods(tree.costs, 5.0).array(), 0.0).sum();
    for (int j = 0; j < i; ++j) EXPECT_FALSE(same_bits(tree, score.trees[static_cast<std::size_t>(j)]));
  }
  EXPECT_NEAR(score.capture.mean, each.mean(), 1e-12);
  EXPECT_NEAR(*score.capture.standard_error, std::sqrt((each.array() - each.mean()).square().sum() / 3.0 / 4.0), 1e-12);
  EXPECT_FALSE(capture_score(problem, options(10)).capture.standard_error);
}

TEST(Capture, MoreTreesKeepTheTreesThatThereWere) {
  const CaptureScore few = capture_score(push(), options(50, 9, 2));
  const CaptureScore many = capture_score(push(), options(50, 9, 3));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_TRUE(same_bits(few.trees[i], many.trees[i]));
}

TEST(Capture, SameSeedGivesTheSameBitsAndAnotherSeedAnotherTree) {
  EXPECT_TRUE(
      same_bits(capture_score(push(), options(80, 4)).trees[0], capture_score(push(), options(80, 4)).trees[0]));
  EXPECT_FALSE(
      same_bits(capture_score(push(), options(80, 4)).trees[0], capture_score(push(), options(80, 5)).trees[0]));
}

TEST(Capture, WithoutASuccessSetThereIsNoSuccessScore) {
  Problem problem = push();
  problem.succeeded.reset();
  EXPECT_FALSE(capture_score(problem, options(10, 0, 2)).success);
}

TEST(Capture, CancelledAtOnceTheRootCountsAlone) {
  const std::atomic<bool> cancel{true};
  CaptureOptions stopped = options(100, 0, 4, 2);
  stopped.limit = Limit(&cancel);
  const CaptureScore score = capture_score(push(), stopped);
  EXPECT_FALSE(score.complete);
  EXPECT_EQ(score.nodes(), 0);
  ASSERT_EQ(score.trees.size(), 1u);
  EXPECT_TRUE(same_bits(State(score.trees[0].states.row(0)), push().state));
  EXPECT_EQ(score.capture.mean, 1.0);
  EXPECT_FALSE(score.capture.standard_error);
}

TEST(Capture, TimeoutGivesTheBitsOfATreeOfSoManyNodes) {
  CaptureOptions timed = options(1000000, 3, 2, 2);
  CaptureScore score;
  score.trees.resize(1);
  for (double timeout = 0.05; score.nodes() < 1; timeout *= 2.0) {
    timed.limit = Limit(nullptr, timeout);
    score = capture_score(push(), timed);
  }
  EXPECT_FALSE(score.complete);
  ASSERT_EQ(score.trees.size(), 1u) << "no tree is complete, and the first counts alone";
  const CaptureScore whole = capture_score(push(), options(score.nodes(), 3));
  EXPECT_TRUE(same_bits(score.trees[0], whole.trees[0]));
  EXPECT_TRUE(same_bits(score.capture.mean, whole.capture.mean));
  EXPECT_TRUE(same_bits(score.success->mean, whole.success->mean));
}

TEST(Capture, TimeoutInARoundGivesTheBitsOfATreeOfSoManyNodes) {
  CaptureOptions timed = in_rounds(64, 1000000, 2);
  CaptureScore score;
  score.trees.resize(1);
  for (double timeout = 0.05; score.nodes() < 1; timeout *= 2.0) {
    timed.limit = Limit(nullptr, timeout);
    score = capture_score(push(), timed);
  }
  EXPECT_FALSE(score.complete);
  EXPECT_TRUE(same_bits(score.trees[0], capture_score(push(), in_rounds(64, score.nodes())).trees[0]));
}

TEST(Capture, OnTimeoutTheFirstTreesThatAreCompleteCount) {
  CaptureOptions timed = options(20, 3, 1000000, 2);
  CaptureScore score;
  for (double timeout = 0.1; score.trees.size() < 3; timeout *= 2.0) {
    timed.limit = Limit(nullptr, timeout);
    score = capture_score(push(), timed);
  }
  EXPECT_FALSE(score.complete);
  EXPECT_EQ(score.nodes(), 20);
  const int count = static_cast<int>(score.trees.size());
  const CaptureScore whole = capture_score(push(), options(20, 3, count));
  EXPECT_TRUE(whole.complete);
  for (std::size_t i = 0; i < score.trees.size(); ++i) EXPECT_TRUE(same_bits(score.trees[i], whole.trees[i]));
  EXPECT_TRUE(same_bits(score.capture.by_tree, whole.capture.by_tree));
  EXPECT_TRUE(same_bits(*score.capture.standard_error, *whole.capture.standard_error));
}

CaptureOptions up_to(double tolerance, std::optional<int> trees = {}, int threads = 1) {
  CaptureOptions made = options(30, 3, 1, threads);
  made.trees = trees;
  made.tolerance = tolerance;
  return made;
}

TEST(Capture, ToleranceAddsTreesUntilEveryStandardErrorIsAtMostThat) {
  const CaptureScore score = capture_score(push(), up_to(0.015));
  EXPECT_TRUE(score.complete);
  const int count = static_cast<int>(score.trees.size());
  ASSERT_GT(count, fewest_trees);
  EXPECT_LE(*score.capture.standard_error, 0.015);
  EXPECT_LE(*score.success->standard_error, 0.015);
  const CaptureScore one_less = capture_score(push(), options(30, 3, count - 1));
  EXPECT_GT(std::max(*one_less.capture.standard_error, *one_less.success->standard_error), 0.015);
  const CaptureScore same = capture_score(push(), options(30, 3, count));
  EXPECT_TRUE(same_bits(score.capture.by_tree, same.capture.by_tree));
  EXPECT_TRUE(same_bits(score.success->by_tree, same.success->by_tree));
}

TEST(Capture, ToleranceGivesTheSameTreesOnAnyNumberOfThreads) {
  const CaptureScore one = capture_score(push(), up_to(0.015));
  for (const int threads : {2, 4}) {
    const CaptureScore other = capture_score(push(), up_to(0.015, {}, threads));
    EXPECT_TRUE(same_bits(other.capture.by_tree, one.capture.by_tree)) << threads << " threads";
    EXPECT_TRUE(same_bits(*other.success->standard_error, *one.success->standard_error)) << threads << " threads";
  }
}

TEST(Capture, ToleranceThatTheTreesDoNotMeetIsNotComplete) {
  const CaptureScore score = capture_score(push(), up_to(1e-6, 10));
  EXPECT_FALSE(score.complete);
  EXPECT_EQ(score.trees.size(), 10u);
  const CaptureScore agree = capture_score(closed_cage(), up_to(1e-6));
  EXPECT_TRUE(agree.complete);
  EXPECT_EQ(agree.trees.size(), static_cast<std::size_t>(fewest_trees));
}

TEST(Capture, BadOptionsAreRejectedByNameAndValue) {
  EXPECT_TRUE(rejects([] { capture_score(push(), options(0)); }, {"nodes is 0", "at least 1"}));
  EXPECT_TRUE(rejects([] { capture_score(push(), options(10, 0, 0)); }, {"trees is 0", "at least 1"}));
  EXPECT_TRUE(rejects([] { capture_score(push(), options(10, 0, 1, -2)); }, {"threads is -2", "at least 1"}));
  CaptureOptions none = options(10);
  none.nodes_per_edge = 0;
  EXPECT_TRUE(rejects([&] { capture_score(push(), none); }, {"nodes_per_edge is 0", "at least 1"}));
  EXPECT_TRUE(rejects([] { capture_score(push(), in_rounds(0, 10)); }, {"nodes_per_round is 0", "at least 1"}));
  none = options(10);
  none.least_likelihood = 1.0;
  EXPECT_TRUE(rejects([&] { capture_score(push(), none); }, {"least_likelihood is 1", "below 1"}));
  CaptureOptions negative = options(10);
  negative.rate = -1.0;
  EXPECT_TRUE(rejects([&] { capture_score(push(), negative); }, {"rate is -1", "at least 0"}));
  for (const double tolerance : {0.0, -0.1, nan}) {
    EXPECT_TRUE(rejects([&] { capture_score(push(), up_to(tolerance)); }, {"tolerance is", "above 0"}));
  }
  EXPECT_TRUE(rejects([&] { capture_score(push(), up_to(0.1, 2)); }, {"trees", "is 2", "at least 8", "tolerance"}));
}

}  // namespace
}  // namespace energymargin

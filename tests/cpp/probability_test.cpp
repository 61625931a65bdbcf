// What a probability is made of: enough draws, and rollouts that do not diverge.

#include "energymargin/metrics/probability.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "base/random_draws.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

Problem drift_for_a_moment() {
  Problem problem = drift();
  problem.horizon = 0.1;
  return problem;
}

// The same weak pushes, but for some that are too strong for numbers.
disturbances::Draws draws(std::uint64_t diverging, const Problem& problem) {
  const auto steps = static_cast<Eigen::Index>(problem.horizon.value() / problem.scene.stepping().step + 0.5);
  return {[=](std::uint64_t index, const Limit&) {
    Wrenches wrenches = Wrenches::Constant(steps, 6, 0.0);
    if (index < diverging) wrenches(0, 0) = 1e300;
    return wrenches;
  }};
}

CaptureProbability probability(int rollouts, std::uint64_t diverging, double most) {
  const Problem problem = drift_for_a_moment();
  ProbabilityOptions options;
  options.rollouts = rollouts;
  options.most_diverged = most;
  options.disturbance = draws(diverging, problem);
  return capture_probability(problem, options);
}

TEST(Probability, AsksForOneDrawAfterTheOtherAndForNoMoreOnceItsTimeIsOver) {
  const Problem problem = drift_for_a_moment();
  std::vector<std::uint64_t> asked;
  std::atomic<bool> cancel{false};
  ProbabilityOptions options;
  options.rollouts = std::numeric_limits<int>::max();
  options.first = 7;
  options.threads = 2;
  options.limit = Limit(&cancel);
  options.disturbance = disturbances::Draws{[&, all = draws(0, problem)](std::uint64_t index, const Limit& limit) {
    asked.push_back(index);
    cancel = asked.size() == 100;
    return all.wrenches(index, limit);
  }};
  const CaptureProbability p = capture_probability(problem, options);
  for (std::size_t i = 0; i < 100; ++i) ASSERT_EQ(asked.at(i), 7 + i);
  EXPECT_EQ(asked.size(), 100u);
  EXPECT_LT(p.rollouts, 100);
  EXPECT_GE(p.rollouts, 80);
  EXPECT_FALSE(p.complete);
}

TEST(Probability, WithoutAnyForceIsThatOfTheFutureAloneAndSearchesSayWhatTheyLack) {
  Problem problem = drift_for_a_moment();
  problem.force = problem.torque = Vector3::Zero();
  ProbabilityOptions options;
  options.rollouts = 2;
  const CaptureProbability p = capture_probability(problem, options);
  EXPECT_EQ(p.all.captured(), p.undisturbed ? 1.0 : 0.0);
  EXPECT_TRUE(rejects([&] { escape_effort(problem); }, {"force and torque", "0 on all axes", "escape_effort"}));
  problem.horizon.reset();
  EXPECT_TRUE(rejects([&] { capture_score(problem); }, {"force and torque", "capture_score"}));
}

TEST(Probability, DrawsInOtherStepsHaveTheSameImpulse) {
  const Problem problem = drift();
  const double step = problem.scene.stepping().step;
  const auto impulse = [](const Draw& draw, double each) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(wrench_axes);
    for (const Push& push : draw.pushes) sum += push.steps * each * push.wrenches;
    return sum;
  };
  for (const DisturbanceModel& model :
       {DisturbanceModel{disturbances::Uniform{}}, {disturbances::Gaussian{1.0, 0.1}}}) {
    const Draw own = draw(model, problem, 120, 3, 5);
    const Draw same = resampled(own, step, step, 120);
    ASSERT_EQ(same.pushes.size(), own.pushes.size());
    for (std::size_t i = 0; i < own.pushes.size(); ++i) {
      EXPECT_EQ(same.pushes[i].wrenches, own.pushes[i].wrenches);
      EXPECT_EQ(same.pushes[i].steps, own.pushes[i].steps);
    }
    for (const auto& [ratio, steps] : {std::pair{2.0, 60}, {3.0, 40}, {2.5, 48}, {0.25, 480}}) {
      const Draw other = resampled(own, step, ratio * step, steps);
      int all = 0;
      for (const Push& push : other.pushes) all += push.steps;
      EXPECT_EQ(all, steps);
      EXPECT_LT((impulse(other, ratio * step) - impulse(own, step)).norm(), 1e-12) << ratio;
    }
  }
}

TEST(Probability, LeavesOutOneRolloutThatDivergedAndCountsIt) {
  const CaptureProbability p = probability(30, 1, 0.01);
  EXPECT_EQ(p.diverged, 1);
  EXPECT_EQ(p.rollouts, 29);
  EXPECT_EQ(p.all.captured(), 1.0);
}

TEST(Probability, IsNoneOfTooManyOrAllRolloutsThatDiverged) {
  EXPECT_THROW(probability(30, 2, 0.01), std::runtime_error);
  EXPECT_THROW(probability(30, 1, 0.0), std::runtime_error);
  EXPECT_THROW(probability(5, 5, 0.99), std::runtime_error);
  EXPECT_THROW(probability(1, 1, 0.01), std::runtime_error);
  EXPECT_EQ(probability(5, 4, 0.99).rollouts, 1);
}

// All of n rollouts stay: the likelihood ratio is the mean of (p / .9)^n over p from .9 to 1.
TEST(Probability, IsAboveAThresholdOnceTheEvidenceIsTwentyToOne) {
  for (const int n : {0, 20, 43, 44, 300, 10000}) {
    const double evidence = (1.0 - std::pow(0.9, n + 1)) / (n + 1) / 0.1 / std::pow(0.9, n);
    EXPECT_EQ(is_above(0.9, n, n).has_value(), evidence >= 20.0) << n;
  }
  EXPECT_EQ(is_above(0.9, 9000, 10000), std::nullopt);
  EXPECT_EQ(is_above(0.9, 0, 10000), false);
  EXPECT_EQ(is_above(0.5, 9000, 10000), true);
}

TEST(Probability, IsSeldomEverCalledAboveOrNotAboveWhatItIs) {
  int above = 0, below = 0;
  for (std::size_t run = 0; run < 2000; ++run) {
    Random random(7, run);
    std::optional<bool> told;
    for (int n = 1, captured = 0; n <= 300 && !told; ++n) {
      captured += random.uniform() < 0.7 ? 1 : 0;
      told = is_above(0.7, captured, n);
    }
    above += told == true ? 1 : 0;
    below += told == false ? 1 : 0;
  }
  EXPECT_LT(above, 0.05 * 2000 + 3 * 10);
  EXPECT_LT(below, 0.05 * 2000 + 3 * 10);
}

// Who asks many questions in a row wants to know, and to go on.
TEST(Probability, OfAnyNumberOfRolloutsThatDivergedIsUnknownIfNoneIsLeft) {
  const CaptureProbability p = probability(5, 5, 1.0);
  EXPECT_EQ(p.diverged, 5);
  EXPECT_EQ(p.rollouts, 0);
  EXPECT_TRUE(std::isnan(p.all.captured()));
}

}  // namespace
}  // namespace energymargin

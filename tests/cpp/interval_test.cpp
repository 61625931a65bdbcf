// How well a few trees know a score.

#include "energymargin/metrics/interval.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"

namespace energymargin {
namespace {

CaptureScore of(const std::vector<double>& scores, double resolution = 0.0) {
  CaptureScore score;
  score.capture.by_tree = Eigen::Map<const Eigen::VectorXd>(scores.data(), static_cast<Eigen::Index>(scores.size()));
  score.resolution = resolution;
  return score;
}

TEST(Interval, IsStudentsTOfTheTreesScores) {
  // Mean 0.5, standard error 0.1 / sqrt(3); the quantile of 2 degrees of freedom is 4.302653.
  const Interval found = interval(of({0.4, 0.5, 0.6}));
  EXPECT_NEAR(found.low, 0.5 - 4.302653 * 0.1 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(found.high, 0.5 + 4.302653 * 0.1 / std::sqrt(3.0), 1e-6);
  const Interval half = interval(of({0.4, 0.5, 0.6}), "capture", 0.5);
  EXPECT_NEAR(half.high, 0.5 + 0.816497 * 0.1 / std::sqrt(3.0), 1e-6);
}

TEST(Interval, NearTheEndOfTheScaleReachesFartherFromIt) {
  // Wilson: the shares p with (0.1 - p)^2 = t^2 / n * variance / 0.09 * p (1 - p).
  const Interval found = interval(of({0.05, 0.1, 0.1, 0.15}, 0.5));
  const double variance = 0.005 / 3.0;
  const double width = 3.182446 * 3.182446 / 4.0 * variance / 0.09;
  EXPECT_NEAR(std::pow(found.high - 0.1, 2), width * found.high * (1.0 - found.high), 1e-8);
  EXPECT_NEAR(found.low, 0.1 - 3.182446 * std::sqrt(variance / 4.0), 1e-6) << "Student's";
  EXPECT_GT(found.high - 0.1, 0.1 - found.low);
}

TEST(Interval, OfTreesThatAgreeIsWhatNoneOfThemCanSee) {
  const Interval found = interval(of({1.0, 1.0, 1.0, 1.0}, 0.02));
  const double width = 3.182446 * 3.182446 / 4.0 * 2.0 * 0.02;  // two nodes
  EXPECT_NEAR(found.low, 1.0 / (1.0 + width), 1e-6);
  EXPECT_EQ(found.high, 1.0);
  const Interval agree = interval(of({0.5, 0.5, 0.5}, 0.02));
  EXPECT_EQ(agree.low, 0.5);
  EXPECT_EQ(agree.high, 0.5);
}

TEST(Interval, IsCutToWhatAScoreCanBe) {
  const Interval found = interval(of({0.0, 1.0}));
  EXPECT_EQ(found.low, 0.0);
  EXPECT_EQ(found.high, 1.0);
}

TEST(Interval, BadArgumentsAreRejectedByNameAndValue) {
  EXPECT_TRUE(rejects([] { interval(of({0.5})); }, {"trees is 1", "two or more"}));
  EXPECT_TRUE(rejects([] { interval(of({0.5, 0.6}), "luck"); }, {"which is 'luck'", "'capture'"}));
  EXPECT_TRUE(rejects([] { interval(of({0.5, 0.6}), "success"); }, {"which is 'success'", "problem has"}));
  for (const double confidence : {0.0, 1.0, std::nan("")}) {
    EXPECT_TRUE(rejects([&] { interval(of({0.5, 0.6}), "capture", confidence); }, {"confidence is", "0 and 1"}));
  }
}

}  // namespace
}  // namespace energymargin

// Rows of plans in other steps.

#include <gtest/gtest.h>

#include "energymargin/plan.hpp"

namespace energymargin {
namespace {

Plan ramp(int rows, double step) {
  Plan plan;
  plan.step = step;
  plan.wrenches.push_back({"a", Wrenches::Zero(rows, 6)});
  plan.targets.push_back({"joint", Eigen::VectorXd::LinSpaced(rows, 0.0, rows - 1.0)});
  plan.wrenches[0].wrenches.col(2) = plan.targets[0].positions;
  return plan;
}

TEST(CoarseRows, AreMeansOfWrenchesAndTheLastTargets) {
  const Plan coarse = coarse_rows(ramp(6, 0.01), 0.02);
  ASSERT_EQ(coarse.rows(), 3);
  EXPECT_EQ(coarse.step, 0.02);
  EXPECT_EQ(coarse.wrenches[0].wrenches.col(2), Eigen::Vector3d(0.5, 2.5, 4.5));
  EXPECT_EQ(coarse.targets[0].positions, Eigen::Vector3d(1.0, 3.0, 5.0));
}

TEST(CoarseRows, LoseNoImpulseWhereStepsDoNotDivide) {
  const Plan fine = ramp(7, 0.01);
  const Plan coarse = coarse_rows(fine, 0.025);
  ASSERT_EQ(coarse.rows(), 3);
  EXPECT_EQ(coarse.wrenches[0].wrenches.col(2), Eigen::Vector3d(1.0, 3.5, 5.5));  // rows 0-2, 3-4, 5-6
  EXPECT_EQ(coarse.targets[0].positions, Eigen::Vector3d(2.0, 4.0, 6.0));
}

TEST(CoarseRows, OfAPlanShorterThanAStepAreOne) {
  const Plan coarse = coarse_rows(ramp(2, 0.01), 0.05);
  ASSERT_EQ(coarse.rows(), 1);
  EXPECT_EQ(coarse.wrenches[0].wrenches(0, 2), 0.5);
}

}  // namespace
}  // namespace energymargin

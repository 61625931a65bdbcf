// Linear equations within an envelope.

#include "physics/native/envelope_lu.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>
#include <vector>

namespace energymargin {
namespace {

// A matrix that is full within a random envelope, and not symmetric. Its diagonal outweighs its rows.
Eigen::MatrixXd random_in_envelope(int size, std::mt19937& random, std::vector<int>& first) {
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  first.resize(static_cast<std::size_t>(size));
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (int i = 0; i < size; ++i) {
    const int begin = std::max(0, i - static_cast<int>(random() % 7));
    first[static_cast<std::size_t>(i)] = begin;
    for (int j = begin; j < i; ++j) {
      matrix(i, j) = even(random);
      matrix(j, i) = even(random);
    }
  }
  for (int i = 0; i < size; ++i) matrix(i, i) = matrix.row(i).cwiseAbs().sum() + 0.1;
  return matrix;
}

void fill(EnvelopeLu& lu, const Eigen::MatrixXd& matrix, const std::vector<int>& first) {
  lu.reset(first);
  for (int i = 0; i < matrix.rows(); ++i) {
    for (int j = first[static_cast<std::size_t>(i)]; j <= i; ++j) {
      lu.row(i)[j] = matrix(i, j);
      lu.row(j)[i] = matrix(j, i);
    }
  }
}

TEST(EnvelopeLu, SolvesWhatEigenSolves) {
  std::mt19937 random(5);
  EnvelopeLu lu;  // one for all: what came before leaves no trace
  for (int i = 0; i < 200; ++i) {
    const int size = 1 + static_cast<int>(random() % 40);
    std::vector<int> first;
    const Eigen::MatrixXd matrix = random_in_envelope(size, random, first);
    const Eigen::VectorXd expected = Eigen::VectorXd::Random(size);
    fill(lu, matrix, first);
    ASSERT_TRUE(lu.factor());
    Eigen::VectorXd found = matrix * expected;
    lu.solve(found.data());
    EXPECT_LT((found - matrix.partialPivLu().solve(matrix * expected)).norm(), 1e-12) << size;
    EXPECT_LT((found - expected).norm(), 1e-11) << size;
  }
}

TEST(EnvelopeLu, TellsOfAPivotThatVanishes) {
  const std::vector<int> first{0, 0, 0};
  EnvelopeLu lu;
  Eigen::Matrix3d matrix;
  matrix << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 5.0, 7.0, 9.0;  // the last row is the sum of the others
  fill(lu, matrix, first);
  EXPECT_FALSE(lu.factor());
  matrix(2, 2) += 1e-14;  // rounding error is no pivot
  fill(lu, matrix, first);
  EXPECT_FALSE(lu.factor());
  matrix(2, 2) += 1e-6;
  fill(lu, matrix, first);
  EXPECT_TRUE(lu.factor());
  lu.reset(first);
  EXPECT_FALSE(lu.factor());
}

TEST(EnvelopeLu, TellsOfANumberThatIsNone) {
  EnvelopeLu lu;
  fill(lu, Eigen::MatrixXd::Constant(1, 1, std::nan("")), {0});
  EXPECT_FALSE(lu.factor());
}

}  // namespace
}  // namespace energymargin

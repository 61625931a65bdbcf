// A (1+1)-CMA-ES with constraints, on functions whose least value is known.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "search/polish.hpp"

namespace energymargin::search {
namespace {

struct Search {
  std::function<double(const Eigen::VectorXd&)> cost;
  std::function<bool(const Eigen::VectorXd&)> feasible;

  // The least cost after so many trials from a feasible point.
  double least(Eigen::VectorXd point, int trials) const {
    Draws rng(7);
    EvolutionStrategy strategy(Eigen::VectorXd::Constant(point.size(), 0.3), rng);
    double best = cost(point);
    for (int i = 0; i < trials; ++i) {
      const Eigen::VectorXd step = strategy.draw(), trial = point + strategy.size() * step;
      if (!feasible(trial)) {
        strategy.tell(step, Outcome::infeasible);
      } else if (cost(trial) < best) {
        best = cost(trial);
        point = trial;
        strategy.tell(step, Outcome::better);
      } else {
        strategy.tell(step, Outcome::worse);
      }
    }
    return best;
  }
};

bool everywhere(const Eigen::VectorXd&) { return true; }

TEST(EvolutionStrategy, FindsTheBottomOfALongNarrowValley) {
  const auto valley = [](const Eigen::VectorXd& x) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < x.size(); ++i) sum += std::pow(1000.0, i / (x.size() - 1.0)) * x[i] * x[i];
    return sum;
  };
  EXPECT_LT((Search{valley, everywhere}.least(Eigen::VectorXd::Ones(6), 4000)), 1e-8);
}

TEST(EvolutionStrategy, FindsTheLeastAtTheEdgeOfAConstraint) {
  const auto slope = [](const Eigen::VectorXd& x) { return x.sum() + x.squaredNorm(); };
  const auto above = [](const Eigen::VectorXd& x) { return x.sum() >= 1.0; };
  const Eigen::Index n = 5;
  const double answer = 1.0 + 1.0 / n;
  EXPECT_NEAR((Search{slope, above}.least(Eigen::VectorXd::Ones(n), 4000)), answer, 1e-3);
}

TEST(EvolutionStrategy, StepsShrinkWhileNothingIsBetterAndGrowWhileAllIs) {
  Draws rng(1);
  EvolutionStrategy strategy(Eigen::VectorXd::Ones(3), rng);
  for (int i = 0; i < 50; ++i) strategy.tell(strategy.draw(), Outcome::worse);
  EXPECT_LT(strategy.size(), 0.1);
  for (int i = 0; i < 50; ++i) strategy.tell(strategy.draw(), Outcome::better);
  EXPECT_GT(strategy.size(), 1.0);
}

}  // namespace
}  // namespace energymargin::search

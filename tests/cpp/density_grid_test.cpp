// The grid of EST: how likely each node is to be drawn.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include "search/planners.hpp"

namespace energymargin::search {
namespace {

Eigen::VectorXi cell(int x, int y) { return Eigen::Vector2i(x, y); }

// The share of the draws in which each node came.
std::map<int, double> shares(const DensityGrid& grid, int draws) {
  Draws rng(1);
  std::map<int, double> shares;
  for (int i = 0; i < draws; ++i) shares[grid.draw(rng)] += 1.0 / draws;
  return shares;
}

TEST(DensityGrid, CellIsDrawnWithAWeightOfOneOverItsNodesAndAnyOfTheseEvenly) {
  DensityGrid grid;
  grid.add(0, cell(0, 0));
  for (const int node : {1, 3, 5}) grid.add(node, cell(-1, 7));
  for (const int node : {2, 4}) grid.add(node, cell(7, -1));
  // The weights are 1, 1/3 and 1/2.
  const double all = 1.0 + 1.0 / 3.0 + 1.0 / 2.0;
  const std::map<int, double> drawn = shares(grid, 100000);
  const double error = 0.006;  // four standard deviations of the likeliest
  EXPECT_NEAR(drawn.at(0), 1.0 / all, error);
  for (const int node : {1, 3, 5}) EXPECT_NEAR(drawn.at(node), 1.0 / 9.0 / all, error) << node;
  for (const int node : {2, 4}) EXPECT_NEAR(drawn.at(node), 1.0 / 4.0 / all, error) << node;
}

TEST(DensityGrid, NodesAreThoseAddedInAscendingOrderHoweverManyCellsThereAre) {
  DensityGrid grid;
  EXPECT_TRUE(grid.empty());
  std::mt19937 random(2);
  for (int node = 0; node < 5000; ++node) {
    grid.add(node, cell(static_cast<int>(random() % 40) - 20, static_cast<int>(random() % 40) - 20));
  }
  EXPECT_FALSE(grid.empty());
  std::vector<int> all(5000);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(grid.nodes(), all);
}

TEST(CellWeights, DrawIsWhereTheSumOfTheWeightsReachesTheShare) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  CellWeights weights;
  std::vector<double> plain;
  for (int count = 1; count <= 70; ++count) {
    plain.push_back(uniform(random));
    weights.add(plain.back());
    const std::size_t changed = random() % plain.size();
    weights.change(changed, 0.5 - plain[changed]);
    plain[changed] = 0.5;
    const double all = std::accumulate(plain.begin(), plain.end(), 0.0);
    double before = 0.0;
    for (std::size_t i = 0; i < plain.size(); before += plain[i], ++i) {
      EXPECT_EQ(weights.at((before + 0.5 * plain[i]) / all), i) << "of " << count;
    }
    EXPECT_EQ(weights.at(0.0), 0u);
    EXPECT_EQ(weights.at(1.0), plain.size() - 1);
  }
}

}  // namespace
}  // namespace energymargin::search

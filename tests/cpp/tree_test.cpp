// The result of a search.

#include "energymargin/search/tree.hpp"

#include <gtest/gtest.h>

namespace energymargin {
namespace {

TEST(Tree, PathLeadsFromTheRootToTheNode) {
  Tree tree;
  tree.costs = Eigen::VectorXd::Zero(5);
  tree.parents.resize(5);
  tree.parents << -1, 0, 0, 1, 3;
  EXPECT_EQ(tree.size(), 5);
  EXPECT_EQ(tree.path_to(4), (std::vector<int>{0, 1, 3, 4}));
  EXPECT_EQ(tree.path_to(2), (std::vector<int>{0, 2}));
  EXPECT_EQ(tree.path_to(0), (std::vector<int>{0}));
}

TEST(Tree, PathToNoNodeIsEmpty) { EXPECT_TRUE(Tree{}.path_to(-1).empty()); }

}  // namespace
}  // namespace energymargin

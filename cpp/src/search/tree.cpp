#include "energymargin/search/tree.hpp"

#include <algorithm>

namespace energymargin {

Eigen::VectorXd Tree::times() const {
  Eigen::VectorXd times = durations;  // a parent comes before its children
  for (int node = 1; node < size(); ++node) times[node] += times[parents[node]];
  return times;
}

std::vector<int> Tree::path_to(int node) const {
  std::vector<int> path;
  for (; node >= 0; node = parents[node]) path.push_back(node);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace energymargin

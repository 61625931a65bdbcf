#include "energymargin/search/tree.hpp"

#include <algorithm>

namespace energymargin {

std::vector<int> Tree::path_to(int node) const {
  std::vector<int> path;
  for (; node >= 0; node = parents[node]) path.push_back(node);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace energymargin

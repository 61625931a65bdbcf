#include "energymargin/search/tree.hpp"

#include <algorithm>
#include <cmath>

#include "energymargin/problem.hpp"

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

search::Edge search::largest_edge(const Problem& problem) {
  const auto objects = static_cast<Eigen::Index>(problem.scene.with_role(Role::object).size());
  Edge largest;
  largest.wrenches.resize(objects * wrench_axes);
  for (Eigen::Index i = 0; i < objects; ++i) {
    largest.wrenches.segment<wrench_axes>(i * wrench_axes) << problem.force, problem.torque;
  }
  largest.steps = static_cast<int>(std::floor(problem.duration / problem.scene.stepping().step + 1e-9));
  return largest;
}

}  // namespace energymargin

#include "energymargin/search/edge.hpp"

#include <cmath>

namespace energymargin::search {

Edge largest_edge(const Problem& problem) {
  const auto objects = static_cast<Eigen::Index>(problem.scene.with_role(Role::object).size());
  Edge largest;
  largest.wrenches.resize(objects * wrench_axes);
  for (Eigen::Index i = 0; i < objects; ++i) {
    largest.wrenches.segment<wrench_axes>(i * wrench_axes) << problem.force, problem.torque;
  }
  largest.steps = static_cast<int>(std::floor(problem.duration / problem.scene.stepping().step + 1e-9));
  return largest;
}

}  // namespace energymargin::search

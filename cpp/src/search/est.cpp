#include "search/est.hpp"

#include <algorithm>
#include <vector>

#include "search/cost_space.hpp"

namespace energymargin::search {

Est::Est(const BoundedProblem& problem, std::uint64_t seed) : EST(problem.space_information()), problem_(problem) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  setProblemDefinition(problem.definition());
  setRange(si_->getMaximumExtent());
  setup();
}

void Est::prune(double bound) {
  std::vector<Motion*> motions;
  for (const auto& cell : tree_.grid) {
    motions.insert(motions.end(), cell.second->data.motions_.begin(), cell.second->data.motions_.end());
  }
  tree_.grid.clear();
  tree_.size = 0;
  pdf_.clear();
  lastGoalMotion_ = nullptr;
  // In the order in which they were made: the grid's own order is that of a hash.
  std::sort(motions.begin(), motions.end(),
            [](const Motion* a, const Motion* b) { return node_of(a->state) < node_of(b->state); });
  for (Motion* motion : motions) {
    if (problem_.worth_keeping(node_of(motion->state), bound)) {
      addMotion(motion);
    } else {
      forget(motion);
    }
  }
}

void Est::forget(Motion* motion) {
  si_->freeState(motion->state);
  siC_->freeControl(motion->control);
  delete motion;
}

}  // namespace energymargin::search

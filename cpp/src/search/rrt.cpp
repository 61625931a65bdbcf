#include "energymargin/search/rrt.hpp"

namespace energymargin::search {

Rrt::Rrt(const BoundedProblem& problem, std::uint64_t seed) : RRT(problem.space_information()) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  setProblemDefinition(problem.definition());
  setup();
}

void Rrt::prune(double bound) {
  std::vector<Motion*> motions;
  nn_->list(motions);
  nn_->clear();
  lastGoalMotion_ = nullptr;
  for (Motion* motion : motions) {
    if (motion->state->as<CostSpace::StateType>()->cost < bound) {
      nn_->add(motion);
    } else {
      si_->freeState(motion->state);
      siC_->freeControl(motion->control);
      delete motion;
    }
  }
}

}  // namespace energymargin::search

#include "search/rrt.hpp"

#include <ompl/datastructures/NearestNeighborsGNAT.h>

#include <algorithm>
#include <vector>

#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

// Of equally near motions the one made first. Which of them OMPL's tree finds depends on pivots that it draws from a
// global seed, and rollouts that leave the object where it is make many such ties.
template <typename Motion>
class FirstNearest : public ompl::NearestNeighborsGNAT<Motion> {
 public:
  Motion nearest(const Motion& target) const override {
    using Gnat = ompl::NearestNeighborsGNAT<Motion>;
    const Motion any = Gnat::nearest(target);
    std::vector<Motion> ties;
    Gnat::nearestR(target, this->distFun_(target, any) * (1.0 + rounding) + rounding, ties);
    ties.push_back(any);
    return *std::min_element(ties.begin(), ties.end(),
                             [](const Motion& a, const Motion& b) { return node_of(a->state) < node_of(b->state); });
  }

 private:
  static constexpr double rounding = 1e-12;
};

}  // namespace

Rrt::Rrt(const BoundedProblem& problem, std::uint64_t seed) : RRT(problem.space_information()), problem_(problem) {
  rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  setProblemDefinition(problem.definition());
  setNearestNeighbors<FirstNearest>();
}

void Rrt::prune(double bound) {
  std::vector<Motion*> motions;
  nn_->list(motions);
  nn_->clear();
  lastGoalMotion_ = nullptr;
  for (Motion* motion : motions) {
    if (problem_.worth_keeping(node_of(motion->state), bound)) {
      nn_->add(motion);
    } else {
      si_->freeState(motion->state);
      siC_->freeControl(motion->control);
      delete motion;
    }
  }
}

}  // namespace energymargin::search

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

ompl::base::PlannerStatus Rrt::solve(const ompl::base::PlannerTerminationCondition& ptc) {
  const ompl::base::PlannerStatus status = RRT::solve(ptc);
  problem_.rethrow();
  return status;
}

// A motion stays if all stay that it grew from: OMPL follows them to the root.
void Rrt::prune(double bound) {
  std::vector<Motion*> motions;
  nn_->list(motions);
  nn_->clear();
  lastGoalMotion_ = nullptr;
  const auto first_gone = [&](const Motion* motion) {
    while (motion && problem_.worth_keeping(node_of(motion->state), bound)) motion = motion->parent;
    return motion;
  };
  const auto gone =
      std::stable_partition(motions.begin(), motions.end(), [&](const Motion* motion) { return !first_gone(motion); });
  for (auto motion = motions.begin(); motion != gone; ++motion) nn_->add(*motion);
  for (auto motion = gone; motion != motions.end(); ++motion) {
    si_->freeState((*motion)->state);
    siC_->freeControl((*motion)->control);
    delete *motion;
  }
}

}  // namespace energymargin::search

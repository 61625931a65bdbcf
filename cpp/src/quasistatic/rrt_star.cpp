#include "quasistatic/rrt_star.hpp"

#include <ompl/geometric/planners/rrt/RRTstar.h>

#include <algorithm>
#include <cmath>

#include "energymargin/random.hpp"
#include "quasistatic/nearest.hpp"
#include "quasistatic/streams.hpp"

namespace energymargin::quasistatic {
namespace {

class RrtStar : public ompl::geometric::RRTstar {
 public:
  RrtStar(BarrierProblem& problem, const ompl::base::ProblemDefinitionPtr& definition)
      : RRTstar(problem.space_information()) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(stream(problem.seed(), streams::rrt_star)));
    setProblemDefinition(definition);
    nn_ = std::make_shared<Nearest<Motion*>>();
    setup();
  }

  bool solved() const { return bestGoalMotion_ != nullptr; }

  // A motion costs at least as much as the one before it, so what stays is a tree.
  void prune(double bound) {
    std::vector<Motion*> motions;
    nn_->list(motions);
    nn_->clear();
    goalMotions_.clear();
    bestGoalMotion_ = nullptr;
    bestCost_ = opt_->infiniteCost();
    const auto above = [bound](const Motion* motion) { return motion->cost.value() >= bound; };
    for (Motion* motion : motions) {
      auto& children = motion->children;
      children.erase(std::remove_if(children.begin(), children.end(), above), children.end());
    }
    for (Motion* motion : motions) {
      if (!above(motion)) {
        nn_->add(motion);
        if (motion->inGoal) goalMotions_.push_back(motion);
      } else {
        si_->freeState(motion->state);
        delete motion;
      }
    }
  }
};

}  // namespace

void rrt_star(BarrierProblem& problem) {
  ompl::base::ProblemDefinitionPtr definition;
  while (!definition && !problem.spent()) definition = problem.ask();
  if (!definition) return;
  RrtStar planner(problem, definition);
  while (!problem.spent()) {
    const double energy = problem.energy();
    planner.solve(ompl::base::PlannerTerminationCondition(
        [&] { return problem.spent() || planner.solved() || problem.energy() < energy; }));
    problem.take(*definition);
    planner.prune(problem.bound());
  }
}

}  // namespace energymargin::quasistatic

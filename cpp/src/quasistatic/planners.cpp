#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/informedtrees/bitstar/ImplicitGraph.h>
#include <ompl/geometric/planners/informedtrees/bitstar/Vertex.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "energymargin/random.hpp"
#include "quasistatic/barrier_problem.hpp"

namespace energymargin::quasistatic {

// Nearest neighbours, of equally near ones the one added first: OMPL's trees depend on a global seed.
template <typename Element>
class Nearest : public ompl::NearestNeighborsLinear<Element> {
 public:
  void nearestK(const Element& element, std::size_t count, std::vector<Element>& neighbors) const override {
    rank(element, std::numeric_limits<double>::infinity());
    count = std::min(count, ranking_.size());
    std::partial_sort(ranking_.begin(), ranking_.begin() + static_cast<std::ptrdiff_t>(count), ranking_.end());
    ranking_.resize(count);
    copy_ranking(neighbors);
  }

  void nearestR(const Element& element, double radius, std::vector<Element>& neighbors) const override {
    rank(element, radius);
    std::sort(ranking_.begin(), ranking_.end());
    copy_ranking(neighbors);
  }

 private:
  void rank(const Element& element, double radius) const {
    ranking_.clear();
    for (std::size_t i = 0; i < this->data_.size(); ++i) {
      const double distance = this->distFun_(this->data_[i], element);
      if (distance <= radius) ranking_.emplace_back(distance, i);
    }
  }

  void copy_ranking(std::vector<Element>& neighbors) const {
    neighbors.clear();
    for (const auto& entry : ranking_) neighbors.push_back(this->data_[entry.second]);
  }

  mutable std::vector<std::pair<double, std::size_t>> ranking_;
};

}  // namespace energymargin::quasistatic

// BIT* takes its neighbours from this template alone, which OMPL's headers declare without a definition.
namespace ompl::geometric {

using energymargin::quasistatic::Nearest;

template <>
void BITstar::ImplicitGraph::setNearestNeighbors<Nearest>() {
  samples_ = std::make_shared<Nearest<VertexPtr>>();
}

template <>
void BITstar::setNearestNeighbors<Nearest>() {
  graphPtr_->setNearestNeighbors<Nearest>();
}

}  // namespace ompl::geometric

namespace energymargin::quasistatic {
namespace {

constexpr unsigned int least_batch = 50;
// A batch adds this share of the samples so far: every batch is searched from the start on.
constexpr double batch_share = 0.25;

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

void bit_star(BarrierProblem& problem) {
  while (!problem.spent()) {
    const ompl::base::ProblemDefinitionPtr definition = problem.ask();
    if (!definition) continue;
    ompl::geometric::BITstar planner(problem.space_information(), "kBITstar");
    planner.setProblemDefinition(definition);
    planner.setNearestNeighbors<Nearest>();
    planner.setPruning(false);
    planner.setStopOnSolnImprovement(true);
    const double energy = problem.energy();
    planner.solve(ompl::base::PlannerTerminationCondition([&] {
      planner.setSamplesPerBatch(std::max(least_batch, static_cast<unsigned int>(batch_share * problem.samples())));
      return problem.spent() || problem.energy() < energy;
    }));
    problem.take(*definition);
  }
}

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

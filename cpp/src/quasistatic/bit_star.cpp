#include "quasistatic/bit_star.hpp"

#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/informedtrees/bitstar/ImplicitGraph.h>
#include <ompl/geometric/planners/informedtrees/bitstar/Vertex.h>

#include <algorithm>

#include "quasistatic/nearest.hpp"

// OMPL declares these templates in its headers, and defines them where no other library can see them.
namespace ompl::geometric {

template <template <typename> class Neighbors>
void BITstar::ImplicitGraph::setNearestNeighbors() {
  samples_ = std::make_shared<Neighbors<VertexPtr>>();
}

template <template <typename> class Neighbors>
void BITstar::setNearestNeighbors() {
  graphPtr_->setNearestNeighbors<Neighbors>();
}

}  // namespace ompl::geometric

namespace energymargin::quasistatic {
namespace {

constexpr unsigned int least_batch = 50;
// A batch adds this share of the samples so far: every batch is searched from the start on.
constexpr double batch_share = 0.25;

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

}  // namespace energymargin::quasistatic

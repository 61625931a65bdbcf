#include "quasistatic/bit_star.hpp"

#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/informedtrees/bitstar/ImplicitGraph.h>
#include <ompl/geometric/planners/informedtrees/bitstar/Vertex.h>

#include <algorithm>

#include "quasistatic/nearest.hpp"

// BIT* takes its neighbours from this template alone. OMPL's headers declare it without a definition, so that others
// can use it only by a specialization.
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

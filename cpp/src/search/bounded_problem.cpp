#include "energymargin/search/bounded_problem.hpp"

#include <ompl/base/Goal.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/ValidStateSampler.h>
#include <ompl/util/Console.h>

#include "../check.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/random.hpp"

namespace energymargin::search {
namespace {

// Streams of one search's seed.
constexpr std::uint64_t sampler_stream = 1;
constexpr std::uint64_t control_stream = 2;

// Below the bound, and within Z_b.
class BelowBound : public ompl::base::StateValidityChecker {
 public:
  BelowBound(const ompl::base::SpaceInformationPtr& si, const CostSpace& space, const Propagator& propagator,
             std::optional<Membership> within)
      : StateValidityChecker(si), space_(space), propagator_(propagator), within_(std::move(within)) {}

  bool isValid(const ompl::base::State* state) const override {
    const auto* node = state->as<CostSpace::StateType>();
    return node->cost < space_.bound() && (!within_ || (*within_)(State(propagator_.state(node->node))));
  }

 private:
  const CostSpace& space_;
  const Propagator& propagator_;
  std::optional<Membership> within_;
};

// The complement of the capture set.
class Outside : public ompl::base::Goal {
 public:
  Outside(const ompl::base::SpaceInformationPtr& si, const Propagator& propagator, Membership captured)
      : Goal(si), propagator_(propagator), captured_(std::move(captured)) {}

  bool isSatisfied(const ompl::base::State* state) const override {
    return !captured_(State(propagator_.state(state->as<CostSpace::StateType>()->node)));
  }

 private:
  const Propagator& propagator_;
  Membership captured_;
};

class OutOfReach : public ompl::base::Goal {
 public:
  using Goal::Goal;
  bool isSatisfied(const ompl::base::State*) const override { return false; }
};

// EST asks for a target before it extends; a random control needs none.
class NoTarget : public ompl::base::ValidStateSampler {
 public:
  using ValidStateSampler::ValidStateSampler;
  bool sample(ompl::base::State*) override { return true; }
  bool sampleNear(ompl::base::State*, const ompl::base::State*, double) override { return true; }
};

}  // namespace

BoundedProblem::BoundedProblem(const Problem& problem, const Region* captured, int nodes, std::uint64_t seed,
                               const Limit& limit)
    : most_nodes_(nodes), limit_(limit) {
  require_at_least("nodes", nodes, 1);
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  space_ = std::make_shared<CostSpace>(problem, stream(seed, sampler_stream));
  const auto controls = std::make_shared<WrenchSpace>(space_, problem, stream(seed, control_stream));
  si_ = std::make_shared<ompl::control::SpaceInformation>(space_, controls);
  propagator_ = std::make_shared<Propagator>(si_, problem, nodes, limit);
  si_->setStatePropagator(propagator_);
  // The control carries its own duration, so OMPL's counts as one.
  si_->setPropagationStepSize(1.0);
  si_->setMinMaxControlDuration(1, 1);
  si_->setValidStateSamplerAllocator(
      [](const ompl::base::SpaceInformation* si) { return std::make_shared<NoTarget>(si); });
  std::optional<Membership> within;
  if (captured && problem.within) within.emplace(*problem.within, problem.scene);
  si_->setStateValidityChecker(std::make_shared<BelowBound>(si_, *space_, *propagator_, std::move(within)));
  si_->setup();

  definition_ = std::make_shared<ompl::base::ProblemDefinition>(si_);
  if (captured) {
    definition_->setGoal(std::make_shared<Outside>(si_, *propagator_, Membership(*captured, problem.scene)));
  } else {
    definition_->setGoal(std::make_shared<OutOfReach>(si_));
  }
  CostSpace::StateType root;
  root.objects = space_->starts();
  root.node = 0;
  definition_->addStartState(&root);
}

ompl::base::PlannerTerminationCondition BoundedProblem::termination() const {
  return ompl::base::PlannerTerminationCondition([this] { return spent(); });
}

bool BoundedProblem::spent() const { return nodes_are_spent() || limit_.reached(); }

}  // namespace energymargin::search

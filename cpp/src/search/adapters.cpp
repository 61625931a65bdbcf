#include "search/adapters.hpp"

#include <ompl/base/Goal.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/ValidStateSampler.h>
#include <ompl/control/StatePropagator.h>

#include <limits>

#include "energymargin/search/bounded_problem.hpp"
#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

// Below the bound, and within Z_b.
class Allowed : public ompl::base::StateValidityChecker {
 public:
  Allowed(const ompl::base::SpaceInformationPtr& si, const BoundedProblem& problem)
      : StateValidityChecker(si), problem_(problem) {}
  bool isValid(const ompl::base::State* state) const override {
    return problem_.answer([&] { return problem_.allowed(node_of(state)); });
  }

 private:
  const BoundedProblem& problem_;
};

// The complement of the capture set.
class Outside : public ompl::base::Goal {
 public:
  Outside(const ompl::base::SpaceInformationPtr& si, const BoundedProblem& problem) : Goal(si), problem_(problem) {}
  bool isSatisfied(const ompl::base::State* state) const override {
    return problem_.answer([&] { return problem_.escaped(node_of(state)); });
  }

 private:
  const BoundedProblem& problem_;
};

// The problem's rollouts as a state propagator: from a state of the CostSpace by a control, which carries its own
// duration. A rollout that reaches the limit, or throws, leads to no node, and to an infinite cost, which is valid
// nowhere.
class Propagator : public ompl::control::StatePropagator {
 public:
  Propagator(const ompl::control::SpaceInformationPtr& si, BoundedProblem& problem)
      : StatePropagator(si), problem_(problem) {}
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double,
                 ompl::base::State* to) const override {
    const int start = node_of(from);  // which may be the same state as `to`
    int node = -1;
    problem_.answer([&] {
      node = problem_.extend(start, si_->getControlSpace()->as<WrenchSpace>()->edge(control));
      return true;
    });
    if (node >= 0) return problem_.describe(node, to);
    auto& nowhere = *to->as<CostSpace::StateType>();
    nowhere.cost = std::numeric_limits<double>::infinity();
    nowhere.node = -1;
  }
  bool canPropagateBackward() const override { return false; }

 private:
  BoundedProblem& problem_;
};

// EST asks for a target before it extends; a random control needs none.
class NoTarget : public ompl::base::ValidStateSampler {
 public:
  using ValidStateSampler::ValidStateSampler;
  bool sample(ompl::base::State*) override { return true; }
  bool sampleNear(ompl::base::State*, const ompl::base::State*, double) override { return true; }
};

}  // namespace

ompl::control::SpaceInformationPtr space_information(const std::shared_ptr<WrenchSpace>& controls,
                                                     BoundedProblem& problem) {
  const auto si = std::make_shared<ompl::control::SpaceInformation>(controls->getStateSpace(), controls);
  si->setStatePropagator(std::make_shared<Propagator>(si, problem));
  // The control carries its own duration, so OMPL's counts as one.
  si->setPropagationStepSize(1.0);
  si->setMinMaxControlDuration(1, 1);
  si->setValidStateSamplerAllocator(
      [](const ompl::base::SpaceInformation* space) { return std::make_shared<NoTarget>(space); });
  si->setStateValidityChecker(std::make_shared<Allowed>(si, problem));
  si->setup();
  return si;
}

ompl::base::ProblemDefinitionPtr definition(const ompl::control::SpaceInformationPtr& si,
                                            const BoundedProblem& problem) {
  const auto definition = std::make_shared<ompl::base::ProblemDefinition>(si);
  definition->setGoal(std::make_shared<Outside>(si, problem));
  CostSpace::StateType root;
  root.objects = si->getStateSpace()->as<CostSpace>()->starts();
  root.node = 0;
  definition->addStartState(&root);
  return definition;
}

}  // namespace energymargin::search

#include "search/adapters.hpp"

#include <ompl/base/Goal.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/ValidStateSampler.h>

#include "energymargin/search/bounded_problem.hpp"
#include "search/cost_space.hpp"
#include "search/propagator.hpp"

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

// An edge on which something throws leads nowhere.
class Answering : public Propagator {
 public:
  Answering(const ompl::control::SpaceInformationPtr& si, RolloutTree& tree, const BoundedProblem& problem)
      : Propagator(si, tree), problem_(problem) {}
  void propagate(const ompl::base::State* from, const ompl::control::Control* control, double duration,
                 ompl::base::State* to) const override {
    to->as<CostSpace::StateType>()->node = -1;
    problem_.answer([&] {
      Propagator::propagate(from, control, duration, to);
      return true;
    });
  }

 private:
  const BoundedProblem& problem_;
};

// EST asks for a target before it extends; a random control needs none.
class NoTarget : public ompl::base::ValidStateSampler {
 public:
  using ValidStateSampler::ValidStateSampler;
  bool sample(ompl::base::State*) override { return true; }
  bool sampleNear(ompl::base::State*, const ompl::base::State*, double) override { return true; }
};

}  // namespace

ompl::control::SpaceInformationPtr space_information(const std::shared_ptr<WrenchSpace>& controls, RolloutTree& tree,
                                                     const BoundedProblem& problem) {
  const auto si = std::make_shared<ompl::control::SpaceInformation>(controls->getStateSpace(), controls);
  si->setStatePropagator(std::make_shared<Answering>(si, tree, problem));
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

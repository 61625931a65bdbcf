// The world as a state propagator, and the controls that it is given.

#include <gtest/gtest.h>
#include <ompl/control/SpaceInformation.h>

#include "energymargin/search/bounded_problem.hpp"
#include "scenes.hpp"
#include "search/cost_space.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

// A problem's propagator with what OMPL wants around it.
struct Kit {
  explicit Kit(const Problem& asked)
      : bounded(asked, nullptr, 10, 0),
        si(bounded.space_information()),
        sampler(si->allocControlSampler()),
        control(si->allocControl()) {
    root.objects = si->getStateSpace()->as<CostSpace>()->starts();
    root.node = 0;
  }
  ~Kit() { si->freeControl(control); }

  void propagate(const CostSpace::StateType& from, CostSpace::StateType& to) {
    si->getStatePropagator()->propagate(&from, control, 1.0, &to);
  }

  BoundedProblem bounded;
  ompl::control::SpaceInformationPtr si;
  ompl::control::ControlSamplerPtr sampler;
  ompl::control::Control* control;
  CostSpace::StateType root;
};

TEST(Propagator, EveryPropagationIsARolloutThatBecomesANode) {
  const Problem problem = push();
  Kit kit(problem);
  CostSpace::StateType state, next;
  kit.si->copyState(&state, &kit.root);
  kit.si->copyState(&next, &kit.root);
  for (int i = 1; i <= 10; ++i) {
    kit.sampler->sample(kit.control);
    kit.propagate(state, next);
    EXPECT_EQ(next.node, i);
    EXPECT_EQ(kit.bounded.nodes(), i);
    EXPECT_EQ(kit.bounded.state(i).head<3>(), next.objects.front().position);
    kit.si->copyState(&state, &next);
  }
  const Tree tree = kit.bounded.take_tree();
  ASSERT_EQ(tree.size(), 11);
  EXPECT_EQ(tree.costs[10], next.cost);
  expect_each_edge_is_a_rollout(tree, problem);
}

TEST(Propagator, FromAndToMayBeTheSameState) {
  const Problem problem = push();
  Kit kit(problem);
  CostSpace::StateType next;
  kit.si->copyState(&next, &kit.root);
  kit.sampler->sample(kit.control);
  kit.propagate(kit.root, next);
  kit.propagate(kit.root, kit.root);
  EXPECT_EQ(kit.root.cost, next.cost);
  EXPECT_EQ(kit.root.objects.front().position, next.objects.front().position);
}

}  // namespace
}  // namespace energymargin::search

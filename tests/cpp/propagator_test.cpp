// The world as a state propagator, and the controls that it is given.

#include "search/propagator.hpp"

#include <gtest/gtest.h>
#include <ompl/control/SpaceInformation.h>

#include <cmath>

#include "scenes.hpp"
#include "search/cost_space.hpp"
#include "search/wrench_space.hpp"
#include "search_checks.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

// A propagator with what OMPL wants around it.
struct Kit {
  explicit Kit(Problem asked_, std::uint64_t seed = 0)
      : asked(std::move(asked_)),
        space(std::make_shared<CostSpace>(asked, seed)),
        controls(std::make_shared<WrenchSpace>(space, asked, seed)),
        si(std::make_shared<ompl::control::SpaceInformation>(space, controls)),
        tree(asked, *space, 10),
        propagator(si, tree),
        sampler(controls->allocControlSampler()),
        control(controls->allocControl()) {
    root.objects = space->starts();
    root.node = 0;
  }
  ~Kit() { controls->freeControl(control); }

  Problem asked;
  std::shared_ptr<CostSpace> space;
  std::shared_ptr<WrenchSpace> controls;
  ompl::control::SpaceInformationPtr si;
  RolloutTree tree;
  Propagator propagator;
  ompl::control::ControlSamplerPtr sampler;
  ompl::control::Control* control;
  CostSpace::StateType root;
};

TEST(Propagator, EveryPropagationIsARolloutThatBecomesANode) {
  const Problem problem = push();
  Kit kit(problem);
  CostSpace::StateType state, next;
  kit.space->copyState(&state, &kit.root);
  kit.space->copyState(&next, &kit.root);
  for (int i = 1; i <= 10; ++i) {
    kit.sampler->sample(kit.control);
    kit.propagator.propagate(&state, kit.control, 1.0, &next);
    EXPECT_EQ(next.node, i);
    EXPECT_EQ(kit.tree.nodes(), i);
    EXPECT_EQ(State(kit.tree.state(i)).head<3>(), next.objects.front().position);
    kit.space->copyState(&state, &next);
  }
  const Tree tree = kit.tree.take_tree(kit.tree.nodes());
  ASSERT_EQ(tree.size(), 11);
  EXPECT_EQ(tree.costs[10], next.cost);
  expect_each_edge_is_a_rollout(tree, problem);
}

TEST(Propagator, FromAndToMayBeTheSameState) {
  const Problem problem = push();
  Kit one(problem), two(problem);
  CostSpace::StateType next;
  one.space->copyState(&next, &one.root);
  one.sampler->sample(one.control);
  one.propagator.propagate(&one.root, one.control, 1.0, &next);
  one.propagator.propagate(&one.root, one.control, 1.0, &one.root);
  EXPECT_EQ(one.root.cost, next.cost);
  EXPECT_EQ(one.root.objects.front().position, next.objects.front().position);
}

}  // namespace
}  // namespace energymargin::search

// The world as a state propagator, and the controls that it is given.

#include "energymargin/search/propagator.hpp"

#include <gtest/gtest.h>
#include <ompl/control/SpaceInformation.h>

#include <cmath>

#include "energymargin/search/cost_space.hpp"
#include "scenes.hpp"
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
        propagator(si, asked, 10),
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
    EXPECT_EQ(kit.propagator.nodes(), i);
    EXPECT_EQ(State(kit.propagator.state(i)).head<3>(), next.objects.front().position);
    kit.space->copyState(&state, &next);
  }
  const Tree tree = kit.propagator.take_tree();
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

TEST(Propagator, WrenchesAreDrawnWithinTheBoundsAndZeroOnAxesWithoutOne) {
  Problem problem = drift();
  problem.force = {2.0, 0.0, 0.5};
  Kit kit(problem);
  Vector3 largest = Vector3::Zero();
  for (int i = 0; i < 1000; ++i) {
    kit.sampler->sample(kit.control);
    const Wrench wrench = kit.controls->wrenches(kit.control).front();
    EXPECT_EQ(wrench.force.y(), 0.0);
    EXPECT_EQ(wrench.torque.head<2>(), Vector2::Zero());
    largest = largest.cwiseMax(wrench.force.cwiseAbs());
    EXPECT_LE(std::abs(wrench.torque.z()), 0.1);
    EXPECT_GE(kit.controls->steps(kit.control), 1);
    EXPECT_LE(kit.controls->steps(kit.control), 120);
  }
  EXPECT_LE(largest.x(), 2.0);
  EXPECT_GT(largest.x(), 1.9);
  EXPECT_LE(largest.z(), 0.5);
  EXPECT_GT(largest.z(), 0.45);
}

TEST(Propagator, DurationsAreShorterThanHalfWithProbabilityTwoToTheMinusAxes) {
  const auto share_below_half = [](const Vector3& force) {
    Problem problem = drift();  // longest edge: 120 steps
    problem.force = force;
    problem.torque.setZero();
    Kit kit(problem, 11);
    int below = 0;
    for (int i = 0; i < 20000; ++i) {
      kit.sampler->sample(kit.control);
      below += kit.controls->steps(kit.control) <= 60 ? 1 : 0;
    }
    return below / 20000.0;
  };
  // Within four standard deviations.
  EXPECT_NEAR(share_below_half({1.0, 0.0, 0.0}), 0.5, 0.015);
  EXPECT_NEAR(share_below_half({1.0, 1.0, 0.0}), 0.25, 0.013);
  EXPECT_NEAR(share_below_half({1.0, 1.0, 1.0}), 0.125, 0.01);
}

TEST(Propagator, SameSeedGivesTheSameControlsAndAnotherSeedOthers) {
  const auto first = [](std::uint64_t seed) {
    Kit kit(push(), seed);
    kit.sampler->sample(kit.control);
    return kit.controls->wrenches(kit.control).front().force;
  };
  EXPECT_EQ(first(5), first(5));
  EXPECT_NE(first(5), first(6));
}

}  // namespace
}  // namespace energymargin::search

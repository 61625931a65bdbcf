// The controls of a search, and how they are drawn.

#include <gtest/gtest.h>
#include <ompl/control/ControlSampler.h>

#include <cmath>

#include "scenes.hpp"
#include "search/cost_space.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

struct Draws {
  explicit Draws(const Problem& problem, std::uint64_t seed = 0, Sampling sampling = Sampling::uniform)
      : controls(std::make_shared<WrenchSpace>(std::make_shared<CostSpace>(problem, seed), problem, seed, sampling)),
        sampler(controls->allocControlSampler()),
        control(controls->allocControl()),
        previous(controls->allocControl()) {}
  ~Draws() {
    controls->freeControl(control);
    controls->freeControl(previous);
  }

  std::shared_ptr<WrenchSpace> controls;
  ompl::control::ControlSamplerPtr sampler;
  ompl::control::Control* control;
  ompl::control::Control* previous;
};

TEST(WrenchSpace, WrenchesAreDrawnWithinTheBoundsAndZeroOnAxesWithoutOne) {
  Problem problem = drift();
  problem.force = {2.0, 0.0, 0.5};
  Draws draws(problem);
  Vector3 largest = Vector3::Zero();
  for (int i = 0; i < 1000; ++i) {
    draws.sampler->sample(draws.control);
    const Edge edge = draws.controls->edge(draws.control);
    EXPECT_EQ(edge.wrenches[1], 0.0);
    EXPECT_EQ(edge.wrenches.segment<2>(3), Vector2::Zero());
    largest = largest.cwiseMax(edge.wrenches.head<3>().cwiseAbs());
    EXPECT_LE(std::abs(edge.wrenches[5]), 0.1);
    EXPECT_GE(edge.steps, 1);
    EXPECT_LE(edge.steps, 120);
  }
  EXPECT_LE(largest.x(), 2.0);
  EXPECT_GT(largest.x(), 1.9);
  EXPECT_LE(largest.z(), 0.5);
  EXPECT_GT(largest.z(), 0.45);
}

TEST(WrenchSpace, DurationsAreShorterThanHalfWithProbabilityTwoToTheMinusAxes) {
  const auto share_below_half = [](const Vector3& force) {
    Problem problem = drift();  // longest edge: 120 steps
    problem.force = force;
    problem.torque.setZero();
    Draws draws(problem, 11);
    int below = 0;
    for (int i = 0; i < 20000; ++i) {
      draws.sampler->sample(draws.control);
      below += draws.controls->edge(draws.control).steps <= 60 ? 1 : 0;
    }
    return below / 20000.0;
  };
  // Within four standard deviations.
  EXPECT_NEAR(share_below_half({1.0, 0.0, 0.0}), 0.5, 0.015);
  EXPECT_NEAR(share_below_half({1.0, 1.0, 0.0}), 0.25, 0.013);
  EXPECT_NEAR(share_below_half({1.0, 1.0, 1.0}), 0.125, 0.01);
}

TEST(WrenchSpace, SameSeedGivesTheSameControlsAndAnotherSeedOthers) {
  const auto first = [](std::uint64_t seed) {
    Draws draws(push(), seed);
    draws.sampler->sample(draws.control);
    return draws.controls->edge(draws.control).wrenches;
  };
  EXPECT_EQ(first(5), first(5));
  EXPECT_NE(first(5), first(6));
}

TEST(WrenchSpace, MixedDrawsRepeatCoastAndPushAtTheEndsAndAlongOneAxisEachInAnEighthAtLeast) {
  Problem problem = drift();
  problem.force = {2.0, 1.0, 0.5};
  Draws draws(problem, 3, Sampling::mixed);
  const Eigen::VectorXd bounds = largest_edge(problem).wrenches;
  int repeated = 0, coasting = 0, at_ends = 0, one_axis = 0, inside = 0;
  for (int i = 0; i < 4000; ++i) {
    draws.sampler->sample(draws.previous);
    draws.sampler->sampleNext(draws.control, draws.previous);
    const Eigen::VectorXd wrenches = draws.controls->edge(draws.control).wrenches;
    ASSERT_TRUE((wrenches.cwiseAbs().array() <= bounds.array()).all());
    const Eigen::Index acting = (wrenches.array() != 0.0).count();
    const bool ends = ((wrenches.cwiseAbs() - bounds).array() == 0.0 || wrenches.array() == 0.0).all();
    if (wrenches == draws.controls->edge(draws.previous).wrenches && acting > 0)
      ++repeated;
    else if (acting == 0)
      ++coasting;
    else if (ends)
      ++at_ends;
    else if (acting == 1)
      ++one_axis;
    else
      ++inside;
  }
  for (const int count : {repeated, coasting, at_ends, one_axis}) EXPECT_GT(count, 400);
  EXPECT_GT(inside, 4000 / 3);  // drawn evenly: what makes AO-x asymptotically optimal
}

TEST(WrenchSpace, UniformDrawsDoNotLookAtTheEdgeBefore) {
  Draws one(drift()), two(drift());
  one.sampler->sample(one.control);
  two.sampler->sampleNext(two.control, two.previous);
  EXPECT_EQ(one.controls->edge(one.control).wrenches, two.controls->edge(two.control).wrenches);
}

TEST(WrenchSpace, LargestEdgeHasTheBoundsOfEachObjectAndWholeSteps) {
  Problem problem = drift();
  problem.duration = 0.1001;
  const Edge largest = largest_edge(problem);
  EXPECT_EQ(largest.steps, 24);
  EXPECT_EQ(largest.wrenches, (Eigen::VectorXd(6) << problem.force, problem.torque).finished());
}

}  // namespace
}  // namespace energymargin::search

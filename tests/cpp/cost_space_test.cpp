// State x cost: distances, samples, copies.

#include "search/cost_space.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

struct StateType : CostSpace::StateType {
  explicit StateType(std::size_t count = 1) { objects.resize(count); }
  BodyState& object(std::size_t index = 0) { return objects[index]; }
};

struct Costing : StateType {
  explicit Costing(double joules) { cost = joules; }
};

TEST(CostSpace, ScalesAreTheReachOfABodyAtRestUnderItsLargestForce) {
  Problem problem = drift();  // 2 kg
  problem.force = {3.0, 4.0, 0.0};
  problem.duration = 0.4;
  const Scales scales(problem, 0);
  EXPECT_NEAR(scales.position, 0.5 * 2.5 * 0.16, 1e-12);
  EXPECT_NEAR(scales.velocity, 2.5 * 0.4, 1e-12);
}

TEST(CostSpace, ScalesOfABodyWithoutPartsAreFinite) {
  Problem problem = drift();
  Scene scene(Vector3::Zero());
  Body ghost = body("object", Compound{}, 2.0, Vector3::Zero(), Role::object);
  ghost.inertial = Inertial{Vector3::Zero(), {0.02, 0.02, 0.02}};
  scene.add_body(ghost);
  problem.scene = scene;
  problem.state = pack(scene);
  problem.force = {3.0, 4.0, 0.0};
  problem.torque.setZero();
  problem.duration = 0.4;
  const Scales scales(problem, 0);
  EXPECT_NEAR(scales.position, 0.5 * 2.5 * 0.16, 1e-12);
  EXPECT_NEAR(scales.velocity, 2.5 * 0.4, 1e-12);
  EXPECT_NEAR(scales.orientation, scales.position / 0.1, 1e-12);  // over its radius of gyration
}

TEST(CostSpace, DistanceIsInUnitsOfTheScales) {
  const CostSpace space(drift(), 0);
  const StateType origin;
  StateType moved;
  moved.object().position.y() = 2.0 * space.scales().front().position;
  EXPECT_NEAR(space.distance(&origin, &moved), 2.0, 1e-12);
  StateType fast;
  fast.object().velocity = {3.0 * space.scales().front().velocity, 0.0, 0.0};
  fast.object().angular_velocity = {0.0, 0.0, 4.0 * space.scales().front().angular_velocity};
  EXPECT_NEAR(space.distance(&origin, &fast), 5.0, 1e-12);
  StateType rotated;
  rotated.object().orientation = turn(space.scales().front().orientation, Vector3::UnitZ());
  EXPECT_NEAR(space.distance(&origin, &rotated), 1.0, 1e-6);
  StateType negated;
  negated.object().orientation.coeffs() = -rotated.object().orientation.coeffs();
  EXPECT_EQ(space.distance(&origin, &negated), space.distance(&origin, &rotated));
}

TEST(CostSpace, CostCountsOnceItHasABound) {
  CostSpace space(drift(), 0);
  const Costing cheap(1.0);
  const Costing dear(3.0);
  const Costing dearer(5.0);
  EXPECT_EQ(space.bound(), infinity);
  EXPECT_EQ(space.distance(&cheap, &dear), 0.0);
  space.lower_bound(8.0);
  EXPECT_EQ(space.bound(), 8.0);
  EXPECT_GT(space.distance(&cheap, &dear), 0.0);
  EXPECT_NEAR(space.distance(&cheap, &dearer), 2.0 * space.distance(&cheap, &dear), 1e-12);
}

TEST(CostSpace, DistanceIsAMetricWithAndWithoutABound) {
  CostSpace space(push(), 3);
  const auto sampler = space.allocStateSampler();
  for (const double bound : {infinity, 2.0}) {
    space.lower_bound(bound);
    for (int i = 0; i < 200; ++i) {
      StateType a, b, c;
      sampler->sampleUniform(&a);
      sampler->sampleUniform(&b);
      sampler->sampleUniform(&c);
      EXPECT_LT(space.distance(&a, &a), 1e-6);
      EXPECT_EQ(space.distance(&a, &b), space.distance(&b, &a));
      EXPECT_LE(space.distance(&a, &c), space.distance(&a, &b) + space.distance(&b, &c) + 1e-9);
    }
  }
}

TEST(CostSpace, SamplesHaveACostBelowTheBoundAndNoNode) {
  CostSpace space(push(), 3);
  const auto sampler = space.allocStateSampler();
  StateType sample;
  sampler->sampleUniform(&sample);
  EXPECT_EQ(sample.cost, 0.0);
  space.lower_bound(0.25);
  double highest = 0.0;
  for (int i = 0; i < 100; ++i) {
    sampler->sampleUniform(&sample);
    EXPECT_EQ(sample.node, -1);
    EXPECT_GE(sample.cost, 0.0);
    EXPECT_LE(sample.cost, 0.25);
    EXPECT_NEAR(sample.object().orientation.norm(), 1.0, 1e-12);
    highest = std::max(highest, sample.cost);
  }
  EXPECT_GT(highest, 0.2);
}

TEST(CostSpace, SameSeedGivesTheSameSamplesAndAnotherSeedOthers) {
  const auto first_sample = [](std::uint64_t seed) {
    const CostSpace space(push(), seed);
    StateType sample;
    space.allocStateSampler()->sampleUniform(&sample);
    return sample.object().position;
  };
  EXPECT_EQ(first_sample(5), first_sample(5));
  EXPECT_NE(first_sample(5), first_sample(6));
}

TEST(CostSpace, CopyIsEqualAndInterpolationReachesBothEnds) {
  const CostSpace space(push(), 3);
  const auto sampler = space.allocStateSampler();
  StateType from, to, copy, between;
  sampler->sampleUniform(&from);
  sampler->sampleUniform(&to);
  from.node = 4;
  from.cost = 1.0;
  to.cost = 3.0;
  space.copyState(&copy, &from);
  EXPECT_TRUE(space.equalStates(&copy, &from));
  EXPECT_EQ(copy.node, 4);
  EXPECT_FALSE(space.equalStates(&to, &from));
  space.interpolate(&from, &to, 0.0, &between);
  EXPECT_LT(space.distance(&between, &from), 1e-6);
  space.interpolate(&from, &to, 1.0, &between);
  EXPECT_LT(space.distance(&between, &to), 1e-6);
  space.interpolate(&from, &to, 0.25, &between);
  EXPECT_NEAR(between.cost, 1.5, 1e-12);
  EXPECT_EQ(between.node, -1);
}

TEST(CostSpace, RotationIsTheShorterWay) {
  const auto oriented = [](const Quaternion& q) {
    BodyState state;
    state.orientation = q;
    return state;
  };
  const BodyState start = oriented(turn(0.5, Vector3::UnitX()));
  const BodyState end = oriented(turn(0.3, Vector3::UnitZ()) * turn(0.5, Vector3::UnitX()));
  EXPECT_TRUE(rotation(start, end).isApprox(Vector3(0.0, 0.0, 0.3), 1e-12));
  EXPECT_TRUE(rotation(start, oriented(Quaternion(-end.orientation.coeffs()))).isApprox(Vector3(0.0, 0.0, 0.3), 1e-12));
  EXPECT_EQ(rotation(start, start).norm(), 0.0);
}

}  // namespace
}  // namespace energymargin::search

// Velocities under Coulomb friction and limited impulses.

#include "physics/native/newton_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "expect.hpp"

namespace energymargin {
namespace {

// Softness, as shares of the inverse effective mass.
constexpr double giving_share = FrictionLaw::normal_share;
constexpr double creeping_share = FrictionLaw::tangential_share;
constexpr double to_rounding = 1e-12;

// A body in the plane y = 0 has the velocities x, z and the turn about y; a point has x, y and z.
using Velocities = Eigen::VectorXd;

Velocities velocities_of(const NewtonSolver& solver, int mover) {
  return Eigen::Map<const Eigen::VectorXd>(solver.velocities(mover), solver.count(mover));
}

int add_mover(NewtonSolver& solver, const Eigen::VectorXd& inertia, const Eigen::VectorXd& free) {
  const int count = static_cast<int>(inertia.size());
  const int mover = solver.add_mover(count);
  for (int i = 0; i < count; ++i) {
    solver.inertia(mover)[i * count + i] = inertia[i];
    solver.free(mover)[i] = free[i];
  }
  return mover;
}

int add_point(NewtonSolver& solver, double mass, const Eigen::Vector3d& free) {
  return add_mover(solver, Eigen::Vector3d::Constant(mass), free);
}

void soften(NewtonSolver& solver, ContactRows& rows, double friction) {
  rows.law.friction = friction;
  rows.law.normal_softness = giving_share * solver.inverse_mass(rows, 2);
  rows.law.tangential_softness = 0.5 * creeping_share * (solver.inverse_mass(rows, 0) + solver.inverse_mass(rows, 1));
}

// A point on another one, or on the ground; the normal is z.
ContactRows& rest_on(NewtonSolver& solver, int upper, int lower, double friction) {
  ContactRows& rows = solver.add_contact(upper, lower);
  for (int row = 0; row < 3; ++row) {
    solver.numbers(rows.of_a)[3 * row + row] = 1.0;
    if (lower >= 0) solver.numbers(rows.of_b)[3 * row + row] = -1.0;
  }
  soften(solver, rows, friction);
  return rows;
}

// A body of the plane at a corner, `arm` from its centre.
ContactRows& stand_on(NewtonSolver& solver, int mover, const Eigen::Vector2d& arm, double friction) {
  ContactRows& rows = solver.add_contact(mover, -1);
  double* const jacobian = solver.numbers(rows.of_a);
  jacobian[0] = 1.0;
  jacobian[2] = arm.y();
  jacobian[6 + 1] = 1.0;
  jacobian[6 + 2] = -arm.x();
  soften(solver, rows, friction);
  return rows;
}

// ---- Coulomb's limit

TEST(NewtonSolver, BlockThatFrictionHoldsCreepsByTheSoftnessAlone) {
  NewtonSolver solver;
  const int block = add_point(solver, 2.0, {0.03, 0.04, -0.101});  // friction has 1 % to spare
  rest_on(solver, block, -1, 0.5);
  ASSERT_TRUE(solver.solve(50, to_rounding));
  const Velocities left = velocities_of(solver, block);
  const double creep = creeping_share / (1.0 + creeping_share);
  EXPECT_LT((left - Eigen::Vector3d(0.03 * creep, 0.04 * creep, -0.101 * giving_share / (1.0 + giving_share))).norm(),
            1e-14);
}

TEST(NewtonSolver, BlockThatSlidesLosesTheSpeedOfItsFriction) {
  NewtonSolver solver;
  const int block = add_point(solver, 2.0, {0.6, 0.8, -1.0});
  rest_on(solver, block, -1, 0.5);
  ASSERT_TRUE(solver.solve(50, to_rounding));
  const double pressed = 1.0 / (1.0 + giving_share);  // of the speed towards the ground
  const Velocities left = velocities_of(solver, block);
  EXPECT_LT((left - Eigen::Vector3d(0.6 * (1.0 - 0.5 * pressed), 0.8 * (1.0 - 0.5 * pressed), pressed - 1.0)).norm(),
            1e-11);
  EXPECT_NEAR(solver.contacts()[0].impulse[2], 2.0 * pressed, 1e-11);
  EXPECT_NEAR(std::hypot(solver.contacts()[0].impulse[0], solver.contacts()[0].impulse[1]), pressed, 1e-11);
}

TEST(NewtonSolver, BlockThatLeavesTheGroundFeelsNothing) {
  NewtonSolver solver;
  const int block = add_point(solver, 2.0, {0.6, 0.8, 1e-6});
  rest_on(solver, block, -1, 0.5);
  ASSERT_TRUE(solver.solve(50, to_rounding));
  EXPECT_EQ(velocities_of(solver, block), Velocities(Eigen::Vector3d(0.6, 0.8, 1e-6)));
}

TEST(NewtonSolver, PointMayCloseItsGapAndNoMore) {
  NewtonSolver solver;
  const int block = add_point(solver, 2.0, {0.0, 0.0, -1.0});
  rest_on(solver, block, -1, 0.5).target[2] = -0.25;
  ASSERT_TRUE(solver.solve(50, to_rounding));
  EXPECT_NEAR(velocities_of(solver, block)[2], -0.25, 0.75 * 1.01 * giving_share);
}

TEST(NewtonSolver, PointsThatAreRedundantShareALoadAndItsFriction) {
  NewtonSolver solver;
  const int block = add_mover(solver, Eigen::Vector3d(2.0, 2.0, 0.01), Eigen::Vector3d(0.1, -1.0, 0.0));
  for (int i = 0; i < 2; ++i) {
    for (const double side : {-0.1, 0.1}) stand_on(solver, block, {side, 0.0}, 0.5);
  }
  ASSERT_TRUE(solver.solve(50, to_rounding));
  for (const ContactRows& rows : solver.contacts()) {
    EXPECT_NEAR(rows.impulse[2], 0.5, 2.0 * giving_share);  // a quarter of 2 kg m/s each
    EXPECT_NEAR(rows.impulse[0], -0.05, 2.0 * giving_share);
    EXPECT_NEAR(rows.impulse[2], solver.contacts()[0].impulse[2], 1e-9);
    EXPECT_NEAR(rows.impulse[0], solver.contacts()[0].impulse[0], 1e-9);
  }
}

// ---- impulses

const Eigen::Vector3d under(0.1, -0.3, -0.04);

// A tower of points that move across the blow that hits the uppermost one.
std::vector<int> add_tower(NewtonSolver& solver, const std::vector<int>& places, const Eigen::Vector3d& blow) {
  std::vector<int> movers(places.size());
  for (const int place : places) {
    const bool top = place + 1 == static_cast<int>(places.size());
    movers[static_cast<std::size_t>(place)] = add_point(solver, 0.3 + 0.1 * place, top ? blow : under);
  }
  for (const int place : places) {
    const auto i = static_cast<std::size_t>(place);
    rest_on(solver, movers[i], i == 0 ? -1 : movers[i - 1], 0.3);
  }
  return movers;
}

const std::vector<int> upwards{0, 1, 2, 3, 4, 5};
const Eigen::Vector3d blow(2.0, 1.0, -3.0);
const Eigen::Vector3d light_blow = 0.01 * blow;  // one that no contact is made harder for

TEST(NewtonSolver, WhatOneBodyGivesAnotherOneGetsToTheLastDigit) {
  for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
    NewtonSolver solver;
    const int light = add_point(solver, 0.01, {0.3, 0.1, -1.0});
    const int heavy = add_point(solver, 5.0, {-0.2, 0.0, 0.1});
    rest_on(solver, light, heavy, 0.4);
    ASSERT_TRUE(solver.solve(50, tolerance));
    const Eigen::Vector3d before = 0.01 * Eigen::Vector3d(0.3, 0.1, -1.0) + 5.0 * Eigen::Vector3d(-0.2, 0.0, 0.1);
    const Eigen::Vector3d after = 0.01 * velocities_of(solver, light) + 5.0 * velocities_of(solver, heavy);
    EXPECT_LT((after - before).norm(), 1e-15) << tolerance;
  }
}

TEST(NewtonSolver, VelocitiesChangeByTheImpulsesHoweverLooseTheTolerance) {
  for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
    NewtonSolver solver;
    const std::vector<int> movers = add_tower(solver, upwards, blow);
    ASSERT_TRUE(solver.solve(50, tolerance)) << tolerance;
    for (std::size_t i = 0; i < movers.size(); ++i) {
      const auto impulse = [&](std::size_t k) {
        return Eigen::Map<const Eigen::Vector3d>(solver.contacts()[k].impulse.data());
      };
      Eigen::Vector3d given = impulse(i);
      if (i + 1 < movers.size()) given -= impulse(i + 1);
      const Eigen::Vector3d free = i + 1 < movers.size() ? under : blow;
      const double mass = 0.3 + 0.1 * static_cast<double>(i);
      EXPECT_LT((mass * (velocities_of(solver, movers[i]) - free) - given).norm(), 1e-14) << tolerance << ", " << i;
    }
  }
}

// Where a point sticks or presses, its velocity is what its impulse says; where it slides, friction is at its limit and
// against the slip.
TEST(NewtonSolver, TowerUnderABlowObeysCoulombsLawToTheTolerance) {
  for (const double tolerance : {1e-5, 1e-6, 1e-9}) {
    NewtonSolver solver;
    add_tower(solver, upwards, blow);
    ASSERT_TRUE(solver.solve(50, tolerance));
    const double slack = 10.0 * tolerance * blow.norm();
    for (const ContactRows& rows : solver.contacts()) {
      ContactVector off;  // of the velocity that the impulse asks for
      for (int row = 0; row < 3; ++row) {
        const auto i = static_cast<std::size_t>(row);
        const double softness = row == 2 ? rows.law.normal_softness : rows.law.tangential_softness;
        off[i] = rows.target[i] - solver.speed(rows, row, solver.all_velocities()) - softness * rows.impulse[i];
      }
      EXPECT_NEAR(rows.impulse[2] > 0.0 ? off[2] : std::max(0.0, off[2]), 0.0, slack);
      const double slip = std::hypot(off[0], off[1]);
      const double friction = std::hypot(rows.impulse[0], rows.impulse[1]);
      const double most = rows.law.friction * rows.impulse[2];
      EXPECT_LE(friction, most * (1.0 + 1e-12));
      if (friction < most * (1.0 - 1e-6)) {
        EXPECT_LT(slip, slack);
      } else if (slip > slack) {
        EXPECT_GT(rows.impulse[0] * off[0] + rows.impulse[1] * off[1], (1.0 - 1e-3) * friction * slip);
      }
    }
  }
}

TEST(NewtonSolver, RowsWithoutLimitsRecoverFromErrorsOfBothSigns) {
  for (const double recovery : {0.2, -0.2}) {
    NewtonSolver solver;
    const int cart = add_mover(solver, Eigen::VectorXd::Constant(1, 4.0), Eigen::VectorXd::Constant(1, 0.5));
    LimitedRow& row = solver.add_limited(cart, -1);
    solver.numbers(row.of_a)[0] = 1.0;
    row.softness = 1e-7 / 4.0;
    row.recovery = recovery;
    EXPECT_TRUE(solver.solve(50, to_rounding));
    solver.recover();
    EXPECT_NEAR(solver.recovery(cart)[0], recovery, 1e-6);
    EXPECT_NEAR(velocities_of(solver, cart)[0], 0.0, 1e-6);
  }
}

TEST(NewtonSolver, RowsWithLimitsReachTheirTargetOrPushAsHardAsTheyMay) {
  const auto driven = [](double limit) {
    NewtonSolver solver;
    const int cart = add_mover(solver, Eigen::VectorXd::Constant(1, 4.0), Eigen::VectorXd::Constant(1, 0.5));
    LimitedRow& row = solver.add_limited(cart, -1);
    solver.numbers(row.of_a)[0] = 1.0;
    row.target = -1.0;
    row.softness = 1e-5 / 4.0;
    row.low = -limit;
    row.high = limit;
    EXPECT_TRUE(solver.solve(50, to_rounding));
    return std::make_pair(velocities_of(solver, cart)[0], solver.limited()[0].impulse);
  };
  const auto [held, enough] = driven(10.0);
  EXPECT_NEAR(held, -1.0, 1.51e-5);
  EXPECT_NEAR(enough, -6.0 / (1.0 + 1e-5), 1e-10);
  const auto [slow, most] = driven(1.0);
  EXPECT_NEAR(slow, 0.25, 1e-14);
  EXPECT_EQ(most, -1.0);
}

// ---- islands and order

TEST(NewtonSolver, IslandsDoNotInfluenceEachOtherByABit) {
  NewtonSolver one, other, both;
  const Eigen::Vector3d push(-0.5, 0.2, -1.0);
  const std::vector<int> first = add_tower(one, upwards, blow);
  const std::vector<int> second = add_tower(other, upwards, push);
  ASSERT_TRUE(one.solve(50, 1e-6));
  ASSERT_TRUE(other.solve(50, 1e-6));
  const int alone = add_point(both, 1.0, {0.1, 0.2, 0.3});
  const std::vector<int> third = add_tower(both, upwards, blow);
  const std::vector<int> fourth = add_tower(both, upwards, push);
  ASSERT_TRUE(both.solve(50, 1e-6));
  EXPECT_EQ(velocities_of(both, alone), Velocities(Eigen::Vector3d(0.1, 0.2, 0.3)));
  for (std::size_t i = 0; i < upwards.size(); ++i) {
    EXPECT_TRUE(same_bits(velocities_of(both, third[i]), velocities_of(one, first[i]))) << i;
    EXPECT_TRUE(same_bits(velocities_of(both, fourth[i]), velocities_of(other, second[i]))) << i;
  }
  EXPECT_EQ(both.iterations(), one.iterations() + other.iterations());
}

TEST(NewtonSolver, OrderOfTheMoversIsOfNoMatterBeyondRounding) {
  NewtonSolver one;
  const std::vector<int> movers = add_tower(one, upwards, blow);
  ASSERT_TRUE(one.solve(50, to_rounding));
  std::vector<int> places = upwards;
  std::mt19937 random(2);
  for (int i = 0; i < 20; ++i) {
    std::shuffle(places.begin(), places.end(), random);
    NewtonSolver other;
    const std::vector<int> shuffled = add_tower(other, places, blow);
    ASSERT_TRUE(other.solve(50, to_rounding)) << i;
    for (std::size_t k = 0; k < places.size(); ++k) {
      EXPECT_LT((velocities_of(other, shuffled[k]) - velocities_of(one, movers[k])).norm(), 1e-9) << i << ", " << k;
    }
  }
}

TEST(NewtonSolver, SolverThatIsClearedSolvesAsANewOne) {
  NewtonSolver fresh, used;
  add_tower(used, upwards, {-5.0, 0.0, -9.0});
  used.solve(50, 1e-6);
  used.clear();
  const std::vector<int> movers = add_tower(fresh, upwards, blow);
  add_tower(used, upwards, blow);
  fresh.solve(50, 1e-6);
  used.solve(50, 1e-6);
  for (const int mover : movers) {
    EXPECT_TRUE(same_bits(velocities_of(used, mover), velocities_of(fresh, mover))) << mover;
  }
}

// ---- settings

TEST(NewtonSolver, MakesAsManyIterationsAsItMayAndTellsThatTheyWereTooFew) {
  NewtonSolver enough;
  add_tower(enough, upwards, blow);
  ASSERT_TRUE(enough.solve(50, 1e-6));
  ASSERT_GT(enough.iterations(), 2);
  for (int most = 1; most <= enough.iterations(); ++most) {
    NewtonSolver solver;
    add_tower(solver, upwards, blow);
    EXPECT_EQ(solver.solve(most, 1e-6), most == enough.iterations()) << most;
    EXPECT_EQ(solver.iterations(), most);
  }
}

TEST(NewtonSolver, TighterToleranceTakesMoreIterations) {
  int last = 0;
  for (const double tolerance : {1e-1, 1e-4, 1e-12}) {
    NewtonSolver solver;
    add_tower(solver, upwards, blow);
    ASSERT_TRUE(solver.solve(50, tolerance)) << tolerance;
    EXPECT_GE(solver.iterations(), last) << tolerance;
    last = solver.iterations();
  }
  EXPECT_GT(last, 2);
}

TEST(NewtonSolver, GuessThatSolvesTheEquationsNeedsNoIteration) {
  NewtonSolver solver, again;
  const std::vector<int> movers = add_tower(solver, upwards, light_blow);
  ASSERT_TRUE(solver.solve(50, to_rounding));
  add_tower(again, upwards, light_blow);
  for (const int mover : movers) {
    std::copy_n(solver.velocities(mover), solver.count(mover), again.velocities(mover));
  }
  ASSERT_TRUE(again.solve(50, 1e-6));
  EXPECT_EQ(again.iterations(), 0);
}

// ---- overlap

TEST(NewtonSolver, RecoveryPartsBodiesBesideTheirVelocities) {
  NewtonSolver with, without;
  for (NewtonSolver* solver : {&with, &without}) {
    const int block = add_mover(*solver, Eigen::Vector3d(2.0, 2.0, 0.01), Eigen::Vector3d(0.01, -0.1, 0.0));
    for (const double side : {-0.1, 0.1}) {
      stand_on(*solver, block, {side, 0.0}, 0.5).recovery = solver == &with ? 0.2 : 0.0;
    }
    ASSERT_TRUE(solver->solve(50, to_rounding));
    solver->recover();
  }
  EXPECT_TRUE(same_bits(velocities_of(with, 0), velocities_of(without, 0)));
  EXPECT_EQ(without.recovery(0)[1], 0.0);  // nothing overlaps
  EXPECT_NEAR(with.recovery(0)[1], 0.2, 0.2 * 2.0 * giving_share);
  EXPECT_NEAR(with.recovery(0)[0], 0.0, 1e-6);  // friction holds it, by a little less
  EXPECT_NEAR(with.recovery(0)[2], 0.0, 1e-12);
}

TEST(NewtonSolver, WhatALoadPressesInIsBorneByHarderContactsUpToAHundredTimes) {
  for (const auto& [speed, given] : {std::pair(1.0, 1e-3), std::pair(10.0, 5e-4), std::pair(200.0, 2e-3)}) {
    NewtonSolver solver;
    const int block = add_point(solver, 2.0, {0.0, 0.0, -0.99 * speed});
    rest_on(solver, block, -1, 0.5);
    ASSERT_TRUE(solver.solve(50, to_rounding));
    EXPECT_NEAR(velocities_of(solver, block)[2], -given, 0.02 * given) << speed;
    solver.recover();
    EXPECT_EQ(solver.recovery(block)[2], 0.0);
  }
}

TEST(NewtonSolver, TellsWhetherAContactWithoutRowsMayHaveClosed) {
  for (const double lacks : {2.0, 0.5}) {
    NewtonSolver solver;
    const int block = add_point(solver, 2.0, {0.0, 0.0, -1.0});
    solver.numbers(solver.open_contacts(block, -1).of_a)[2] = 1.0 / lacks;
    ASSERT_TRUE(solver.solve(50, to_rounding));
    EXPECT_NEAR(velocities_of(solver, block)[2], -1.0, 1e-12);
    EXPECT_EQ(solver.closes(), lacks < 1.0);
  }
}

}  // namespace
}  // namespace energymargin

// Coulomb's law at one contact point.

#include "physics/native/friction_law.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace energymargin {
namespace {

const FrictionLaw rough{0.5, 2e-5, 1e-5};

ContactResponse response_of(const FrictionLaw& law, const ContactVector& miss) {
  ContactResponse response{};
  coulomb(law, miss, response);
  return response;
}

double friction_of(const ContactVector& impulse) { return std::hypot(impulse[0], impulse[1]); }

TEST(FrictionLaw, PointThatPartsHasNoImpulse) {
  for (const double normal : {0.0, -1e-9, -1.0}) {
    const ContactResponse response = response_of(rough, {0.3, -0.2, normal});
    EXPECT_EQ(response.regime, Regime::open);
    EXPECT_EQ(response.impulse, ContactVector{});
    for (const ContactVector& row : response.slope) EXPECT_EQ(row, ContactVector{});
  }
}

TEST(FrictionLaw, PointThatSticksResistsAlongEachAxisByItsSoftness) {
  const ContactResponse response =
      response_of(rough, {0.3e-3, -0.4e-3, 1e-3});  // 25 N s of the 50 that the cone allows
  EXPECT_EQ(response.regime, Regime::sticks);
  EXPECT_DOUBLE_EQ(response.impulse[0], 15.0);
  EXPECT_DOUBLE_EQ(response.impulse[1], -20.0);
  EXPECT_DOUBLE_EQ(response.impulse[2], 100.0);
}

TEST(FrictionLaw, PointThatSlidesRubsByItsFrictionTimesItsNormalImpulse) {
  const ContactResponse response = response_of(rough, {0.6, -0.8, 1e-3});
  EXPECT_EQ(response.regime, Regime::slides);
  EXPECT_DOUBLE_EQ(response.impulse[0], 30.0);
  EXPECT_DOUBLE_EQ(response.impulse[1], -40.0);
  EXPECT_DOUBLE_EQ(response.impulse[2], 100.0);
}

TEST(FrictionLaw, PointWithoutFrictionOnlyPresses) {
  const ContactResponse response = response_of({0.0, 2e-5, 1e-5}, {0.6, -0.8, 1e-3});
  EXPECT_EQ(response.impulse[0], 0.0);
  EXPECT_EQ(response.impulse[1], 0.0);
  EXPECT_DOUBLE_EQ(response.impulse[2], 100.0);
}

TEST(FrictionLaw, SlopeIsTheDerivativeOfTheImpulseInEachRegime) {
  const std::vector<ContactVector> misses{{0.1, 0.2, -0.5}, {0.3e-3, -0.4e-3, 1e-3}, {0.6, -0.8, 1e-3}};
  const std::vector<Regime> regimes{Regime::open, Regime::sticks, Regime::slides};
  for (std::size_t i = 0; i < misses.size(); ++i) {
    const ContactResponse at = response_of(rough, misses[i]);
    ASSERT_EQ(at.regime, regimes[i]);
    for (std::size_t column = 0; column < 3; ++column) {
      const double off = 1e-7;
      ContactVector more = misses[i], less = misses[i];
      more[column] += off;
      less[column] -= off;
      const ContactVector above = response_of(rough, more).impulse, below = response_of(rough, less).impulse;
      for (std::size_t row = 0; row < 3; ++row) {
        const double expected = (above[row] - below[row]) / (2.0 * off);
        EXPECT_NEAR(at.slope[row][column], expected, 1e-3) << i << ": " << row << ", " << column;  // of 1e5
      }
    }
  }
}

TEST(FrictionLaw, RowsThatTurnShareTheConeAndTheSlopeIsTheirDerivativeToo) {
  for (const int rows : {4, 6}) {
    FrictionLaw law = rough;
    law.rows = rows;
    for (const double size : {1e-5, 1.0}) {  // it sticks, it slides
      const ContactVector miss{0.3 * size, -0.2 * size, 1e-3, 0.4 * size, -0.1 * size, 0.5 * size};
      const ContactResponse at = response_of(law, miss);
      ASSERT_EQ(at.regime, size < 1.0 ? Regime::sticks : Regime::slides);
      double friction = 0.0;
      for (int row = 0; row < rows; ++row) friction += row == normal_row ? 0.0 : std::pow(at.impulse[row], 2);
      EXPECT_LE(std::sqrt(friction), law.friction * at.impulse[normal_row] * (1.0 + 1e-12));
      for (int column = 0; column < rows; ++column) {
        const double off = 1e-4 * size;
        ContactVector more = miss, less = miss;
        more[column] += column == normal_row ? 1e-7 : off;
        less[column] -= column == normal_row ? 1e-7 : off;
        const ContactVector above = response_of(law, more).impulse, below = response_of(law, less).impulse;
        for (int row = 0; row < rows; ++row) {
          const double expected = (above[row] - below[row]) / (more[column] - less[column]);
          EXPECT_NEAR(at.slope[row][column], expected, 1e-6 * std::abs(expected) + 1e-3)
              << rows << ": " << row << ", " << column;
        }
      }
    }
  }
}

TEST(FrictionLaw, ImpulseDoesNotJumpFromOneRegimeToTheNext) {
  const double edge = rough.friction * 100.0 * rough.tangential_softness;  // the slip at which 100 N s begin to slide
  const ContactResponse sticks = response_of(rough, {edge * (1.0 - 1e-12), 0.0, 1e-3});
  const ContactResponse slides = response_of(rough, {edge * (1.0 + 1e-12), 0.0, 1e-3});
  ASSERT_EQ(sticks.regime, Regime::sticks);
  ASSERT_EQ(slides.regime, Regime::slides);
  for (std::size_t row = 0; row < 3; ++row) EXPECT_NEAR(sticks.impulse[row], slides.impulse[row], 1e-9);
  EXPECT_LT(friction_of(response_of(rough, {0.3, 0.4, 1e-15}).impulse), 1e-9);
}

TEST(FrictionLaw, NoImpulseLeavesTheConeOrGivesEnergy) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const double scale = std::pow(10.0, -3.0 + 3.0 * normal(random));
    const FrictionLaw law{std::abs(normal(random)), 1e-5 * std::exp(normal(random)), 1e-5 * std::exp(normal(random))};
    const ContactVector miss{scale * normal(random), scale * normal(random), 1e-3 * normal(random)};
    const ContactVector impulse = response_of(law, miss).impulse;
    EXPECT_GE(impulse[2], 0.0);
    EXPECT_LE(friction_of(impulse), law.friction * impulse[2] * (1.0 + 1e-14));
    EXPECT_GE(impulse[0] * miss[0] + impulse[1] * miss[1], 0.0);
  }
}

TEST(FrictionLaw, FrictionWhoseBoundIsWhatTheNormalGivesIsCoulombs) {
  for (const ContactVector& miss : {ContactVector{0.3e-3, -0.4e-3, 1e-3}, {0.6, -0.8, 1e-3}, {0.0, 0.0, 1e-3}}) {
    const ContactResponse at = response_of(rough, miss);
    ContactResponse again;
    tresca(rough, miss, rough.friction * at.impulse[2], again);
    EXPECT_EQ(again.regime, at.regime);
    for (std::size_t row = 0; row < 3; ++row) EXPECT_NEAR(again.impulse[row], at.impulse[row], 1e-12 * 100.0);
  }
}

TEST(FrictionLaw, FrictionWithAFixedBoundIsTheSlopeOfAConvexCost) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int rows : {3, 6}) {
    for (int i = 0; i < 1000; ++i) {
      FrictionLaw law{0.5, 2e-5, 1e-5};
      law.rows = rows;
      const double bound = std::exp(3.0 * normal(random));
      ContactVector one{}, other{};
      for (int row = 0; row < rows; ++row) {
        one[static_cast<std::size_t>(row)] = 1e-3 * normal(random);
        other[static_cast<std::size_t>(row)] = 1e-3 * normal(random);
      }
      ContactResponse at_one{}, at_other{};
      tresca(law, one, bound, at_one);
      tresca(law, other, bound, at_other);
      double grows = 0.0;
      for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
        grows += (at_one.impulse[row] - at_other.impulse[row]) * (one[row] - other[row]);
        for (std::size_t k = 0; k < row; ++k) {
          EXPECT_NEAR(at_one.slope[row][k], at_one.slope[k][row], 1e-12 / law.normal_softness);
        }
      }
      EXPECT_GE(grows, 0.0);
    }
  }
}

TEST(FrictionLaw, RegimeThatIsGivenHoldsOnBothSidesOfItsEdge) {
  ContactResponse pulls, beyond;
  respond_as(Regime::sticks, rough, {0.0, 0.0, -1e-3}, pulls);
  EXPECT_DOUBLE_EQ(pulls.impulse[2], -100.0);
  respond_as(Regime::sticks, rough, {0.6, -0.8, 1e-3}, beyond);
  EXPECT_DOUBLE_EQ(beyond.impulse[0], 0.6 / rough.tangential_softness);
}

}  // namespace
}  // namespace energymargin

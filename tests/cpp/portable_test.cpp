// Functions and draws with the same bits on every processor: they are those of the C library, of Eigen and of OMPL, but
// for the last digit.

#include "base/portable.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "search/ompl_random.hpp"

namespace energymargin {
namespace {

constexpr double digit = 4e-16;

TEST(Portable, FunctionsAreThoseOfTheLibrary) {
  for (int i = 1; i < 1000; ++i) {
    const double x = 0.001 * i;
    for (const auto& [ours, theirs] : {std::pair(portable::sin(7.0 * x), std::sin(7.0 * x)),
                                       {portable::cos(7.0 * x), std::cos(7.0 * x)},
                                       {portable::tan(x), std::tan(x)},
                                       {portable::asin(x), std::asin(x)},
                                       {portable::acos(x), std::acos(x)},
                                       {portable::atan(9.0 * x), std::atan(9.0 * x)},
                                       {portable::exp(-9.0 * x), std::exp(-9.0 * x)},
                                       {portable::log(x), std::log(x)},
                                       {portable::log1p(x), std::log1p(x)},
                                       {portable::asinh(9.0 * x), std::asinh(9.0 * x)},
                                       {portable::atan2(x, x - 0.5), std::atan2(x, x - 0.5)},
                                       {portable::pow(9.0 * x, x), std::pow(9.0 * x, x)}}) {
      EXPECT_NEAR(ours, theirs, digit * std::max(1.0, std::abs(theirs))) << x;
    }
  }
}

TEST(Portable, TurnsAreThoseOfEigen) {
  Draws draws(3);
  for (int i = 0; i < 100; ++i) {
    const Quaternion one = draws.turn(), other = draws.turn();
    const double angle = draws.uniformReal(-3.0, 3.0), share = draws.uniform01();
    const Vector3 axis = one.vec().normalized();
    EXPECT_LT(portable::turn(angle, axis).angularDistance(Quaternion(Eigen::AngleAxisd(angle, axis))), 1e-7);
    EXPECT_LT(portable::slerp(one, share, other).angularDistance(one.slerp(share, other)), 1e-7);
    const Eigen::AngleAxisd turn(one);
    EXPECT_NEAR((portable::rotation_vector(one) - turn.angle() * turn.axis()).norm(), 0.0, 1e-14);
  }
  EXPECT_EQ(portable::rotation_vector(Quaternion::Identity()).norm(), 0.0);
  EXPECT_NEAR(portable::rotation_vector(Quaternion(1.0, 1e-200, 0.0, 0.0)).x() / 2e-200, 1.0, 1e-12);
}

TEST(Draws, AreThoseOfOmpl) {
  Draws ours(5);
  ompl::RNG theirs(5);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_NEAR(ours.gaussian(2.0, 3.0), theirs.gaussian(2.0, 3.0), 1e-14);
    EXPECT_EQ(ours.uniform01(), theirs.uniform01());
    double turn[4];
    theirs.quaternion(turn);
    EXPECT_LT(ours.turn().angularDistance(Quaternion(turn)), 1e-7);
  }
}

}  // namespace
}  // namespace energymargin

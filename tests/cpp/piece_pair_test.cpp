// Two convex pieces that move and turn: never let through each other, and let go where they part.

#include "physics/contacts/piece_pair.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace energymargin {
namespace {

constexpr double skin = 0.001;  // the margin of both [m]
const btVector3 still(0.0, 0.0, 0.0);

template <typename Shape>
Shape with_margin(Shape shape) {
  shape.setMargin(skin);
  return shape;
}

ConvexPiece piece(const btConvexShape& shape, double reach, double half_extent) {
  return {&shape, btTransform::getIdentity(), true, reach, half_extent};
}

Sweep sweep(const btTransform& start, const btVector3& linear, const btVector3& angular) {
  return {start, linear, angular, false};
}

btTransform standing(const btVector3& place) { return btTransform(btQuaternion::getIdentity(), place); }

// A standing cylinder beside a box, which is a fixed one or turns as a link does.
struct Pair {
  btBoxShape box = with_margin(btBoxShape(btVector3(0.1, 0.1, 0.1)));
  btCylinderShapeZ cylinder = with_margin(btCylinderShapeZ(btVector3(0.03, 0.03, 0.05)));
  PiecePair pieces{piece(cylinder, 0.06, 0.03), piece(box, 0.18, 0.1)};
};

TEST(PiecePair, CylinderThatSpunAgainstABoxAndIsSqueezedIntoItMayLeaveAndGoNoDeeper) {
  Pair pair;
  btTransform cylinder = standing({0.13, 0.0, 0.0});
  const btTransform box = standing(still);
  const auto share = [&](const btVector3& way, const btVector3& turn) {
    return pair.pieces.safe_share(sweep(cylinder, way, turn), sweep(box, still, still));
  };
  for (int i = 0; i < 31; ++i) {
    EXPECT_EQ(share(still, {0.0, 0.0, 0.1}), 1.0) << i;
    cylinder = sweep(cylinder, still, {0.0, 0.0, 0.1}).at(1.0);
  }
  cylinder.setOrigin({0.13 - 2.5 * skin, 0.0, 0.0});  // the inner shapes overlap
  EXPECT_EQ(share({0.002, 0.0, 0.0}, still), 1.0);
  EXPECT_LT(share({-0.02, 0.0, 0.0}, still), 0.1);
}

// Each of them turns, pushes and slides at random. What may overlap is 0.7 of their margins.
TEST(PiecePair, CylinderThatSpinsIsNotLetThroughTheFaceOfABoxThatTurns) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto vector = [&](double extent) { return extent * btVector3(even(random), even(random), even(random)); };
  int limited = 0, whole = 0;
  double deepest = 0.0;
  for (int run = 0; run < 60; ++run) {
    Pair pair;
    SolidPair solids(pair.cylinder, pair.box);
    btTransform box = standing(still), cylinder = standing({0.135, 0.0, 0.0});
    const btVector3 turning = vector(run % 2 ? 0.02 : 0.3);
    for (int step = 0; step < 100; ++step) {
      const Sweep of_box{box, still, turning + vector(0.01), run % 3 == 0};
      const btVector3 toward = (box.getOrigin() - cylinder.getOrigin()).normalized();
      const btVector3 spin = cylinder.getBasis().getColumn(2) * (3.0 * even(random)) + vector(0.05);
      const Sweep of_cylinder{cylinder, 0.01 * toward + vector(step % 10 ? 0.02 : 0.2), spin, false};
      const double share = pair.pieces.safe_share(of_cylinder, of_box);
      (share < 1.0 ? limited : whole) += 1;
      for (double part = 0.1; part < 1.05; part += 0.1) {
        ClosestPoints found{};
        const Separation state =
            solids.inner_distance(of_cylinder.at(share * part), of_box.at(share * part), 1e18, found);
        ASSERT_EQ(state, Separation::apart) << run << ", " << step << ", " << part << ", share " << share;
        deepest = std::max(deepest, 2.0 * skin - found.distance);
      }
      box = of_box.at(share);
      cylinder = of_cylinder.at(share);
    }
  }
  EXPECT_LT(deepest, 1.01 * pressed_deeper * 0.7 * 2.0 * skin);
  EXPECT_GT(limited, 1000);
  EXPECT_GT(whole, 1000);
}

}  // namespace
}  // namespace energymargin

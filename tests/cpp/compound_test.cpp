// Compounds as values: mass properties against closed forms, extents, and what is no compound.

#include <gtest/gtest.h>

#include <cmath>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// The inertia about the centre of mass, along the shape's axes.
Eigen::Matrix3d tensor(const MassProperties& mass) {
  const Eigen::Matrix3d axes = mass.axes.toRotationMatrix();
  return axes * mass.moments.asDiagonal() * axes.transpose();
}

// What a point mass adds about the origin.
Eigen::Matrix3d of_point(double mass, const Vector3& at) {
  return mass * (at.squaredNorm() * Eigen::Matrix3d::Identity() - at * at.transpose());
}

const Quaternion oblique = turn(0.8, Vector3(1.0, 2.0, -0.5).normalized());

TEST(Compound, TwoBoxesThatMakeOneBoxHaveItsMassProperties) {
  const Compound halves{{{Box{{0.2, 0.4, 0.6}}, {{0.1, 0.5, 0.0}}}, {Box{{0.1, 0.4, 0.6}}, {{0.25, 0.5, 0.0}}}}};
  const MassProperties two = mass_properties(halves, 3.0);
  const MassProperties one = mass_properties(Box{{0.3, 0.4, 0.6}}, 3.0);
  EXPECT_NEAR(two.volume, one.volume, 1e-15);
  EXPECT_LT((two.center - Vector3(0.15, 0.5, 0.0)).norm(), 1e-15);
  EXPECT_TRUE(tensor(two).isApprox(tensor(one), 1e-14));
}

TEST(Compound, PartsShareTheMassByTheirVolumes) {
  const double small = 4.0 / 3.0 * pi * 0.001;
  const double great = 8.0 * small;
  const Compound pair{{{Sphere{0.1}, {{1.0, 0.0, 0.0}}}, {Sphere{0.2}, {{-0.5, 0.0, 0.0}}}}};
  const MassProperties mass = mass_properties(pair, 9.0);
  EXPECT_NEAR(mass.volume, small + great, 1e-15);
  EXPECT_LT((mass.center - Vector3((1.0 - 8.0 * 0.5) / 9.0, 0.0, 0.0)).norm(), 1e-15);
  const double along = 0.4 * (1.0 * 0.01 + 8.0 * 0.04);
  const double across = along + 1.0 * 8.0 / 9.0 * 1.5 * 1.5;  // the reduced mass, at their distance
  EXPECT_TRUE(tensor(mass).isApprox(Vector3(along, across, across).asDiagonal().toDenseMatrix(), 1e-14));
}

TEST(Compound, DumbbellOfDiscsFollowsTheTheoremOfParallelAxes) {
  const double disc = 2.0;
  const Compound dumbbell{{{Cylinder{0.3, 0.1}, {{0.0, 0.0, 0.4}}}, {Cylinder{0.3, 0.1}, {{0.0, 0.0, -0.4}}}}};
  const MassProperties mass = mass_properties(dumbbell, 2.0 * disc);
  const double across = 2.0 * disc * ((3.0 * 0.09 + 0.01) / 12.0 + 0.16);
  EXPECT_TRUE(tensor(mass).isApprox(Vector3(across, across, disc * 0.09).asDiagonal().toDenseMatrix(), 1e-14));
}

TEST(Compound, TurnedPartHasTheInertiaOfTheTurnedSolid) {
  const Vector3 at(0.3, -0.2, 0.7);
  const MassProperties part = mass_properties(Compound{{{Box{{0.3, 0.7, 1.1}}, {at, oblique}}}}, 2.5);
  const MassProperties hull = mass_properties(brick({0.3, 0.7, 1.1}, oblique, at), 2.5);
  EXPECT_NEAR(part.volume, hull.volume, 1e-12);
  EXPECT_TRUE(part.center.isApprox(hull.center, 1e-12));
  EXPECT_TRUE(tensor(part).isApprox(tensor(hull), 1e-12));
}

TEST(Compound, TurningAndMovingTheWholeTurnsAndMovesItsMassProperties) {
  const Compound flat{{{Box{{0.3, 0.1, 0.1}}, {{0.1, 0.0, 0.05}, turn(0.3, Vector3::UnitY())}},
                       {Capsule{0.05, 0.2}, {{0.0, 0.1, 0.2}, turn(1.0, Vector3::UnitX())}},
                       {brick({0.1, 0.2, 0.3}, oblique, {0.4, 0.0, 0.0}), {{-0.2, 0.0, 0.1}, oblique}}}};
  const Vector3 moved(0.5, -1.0, 2.0);
  Compound whole = flat;
  for (Part& part : whole.parts) {
    part.pose = {oblique * part.pose.position + moved, oblique * part.pose.orientation};
  }
  const MassProperties before = mass_properties(flat, 1.7);
  const MassProperties after = mass_properties(whole, 1.7);
  const Eigen::Matrix3d rotation = oblique.toRotationMatrix();
  EXPECT_NEAR(after.volume, before.volume, 1e-14);
  EXPECT_TRUE(after.center.isApprox(oblique * before.center + moved, 1e-14));
  EXPECT_TRUE(tensor(after).isApprox(rotation * tensor(before) * rotation.transpose(), 1e-12));
}

TEST(Compound, LShapeIsTheSquareWithoutItsCorner) {
  // A plate of 2 x 2 x 1 kg, of which a quarter is missing, by subtraction about the origin.
  const Compound angle{{{Box{{2.0, 1.0, 0.5}}, {{0.0, -0.5, 0.0}}}, {Box{{1.0, 1.0, 0.5}}, {{-0.5, 0.5, 0.0}}}}};
  const MassProperties mass = mass_properties(angle, 3.0);
  const Vector3 gap(0.5, 0.5, 0.0);
  const Vector3 center = -gap / 3.0;
  const Eigen::Matrix3d whole = mass_properties(Box{{2.0, 2.0, 0.5}}, 4.0).moments.asDiagonal().toDenseMatrix();
  const Eigen::Matrix3d missing =
      mass_properties(Box{{1.0, 1.0, 0.5}}, 1.0).moments.asDiagonal().toDenseMatrix() + of_point(1.0, gap);
  EXPECT_LT((mass.center - center).norm(), 1e-15);
  EXPECT_TRUE(tensor(mass).isApprox(whole - missing - of_point(3.0, center), 1e-14));
}

TEST(Compound, SolidSpeaksForThePartsAndScalesWithTheMass) {
  Compound mesh{{{Box{{0.3, 0.4, 0.6}}}}};
  mesh.solid = MassProperties{0.05, {0.1, 0.2, 0.3}, {0.01, 0.02, 0.025}, oblique};
  for (const double kilograms : {1.0, 2.5}) {
    const MassProperties mass = mass_properties(mesh, kilograms);
    EXPECT_EQ(mass.volume, 0.05);
    EXPECT_EQ(mass.center, Vector3(0.1, 0.2, 0.3));
    EXPECT_TRUE(mass.moments.isApprox(kilograms * Vector3(0.01, 0.02, 0.025), 1e-15));
    EXPECT_EQ(mass.axes.coeffs(), oblique.coeffs());
  }
}

TEST(Compound, WithoutPartsThereIsNoMassToSpreadAndNoExtent) {
  EXPECT_EQ(mass_properties(Compound{}, 1.0).volume, 0.0);
  EXPECT_EQ(mass_properties(Compound{}, 1.0).moments, Vector3::Zero());
  EXPECT_EQ(smallest_half_extent(Compound{}), infinity);
  EXPECT_NO_THROW(validate(Compound{}));
}

TEST(Compound, SmallestHalfExtentIsThatOfItsMostSolidPart) {
  EXPECT_EQ(smallest_half_extent(Compound{{{Box{{3.0, 0.001, 2.0}}}, {Sphere{0.1}}, {Box{{1.0, 0.5, 0.7}}}}}), 0.25);
  EXPECT_EQ(smallest_half_extent(Compound{{{Cylinder{0.1, 0.4}, {{9.0, 0.0, 0.0}, oblique}}}}), 0.1);
}

// The farthest of many points of a body's surface.
double farthest(const std::vector<Vector3>& surface, const Vector3& from) {
  double most = 0.0;
  for (const Vector3& point : surface) most = std::max(most, (point - from).norm());
  return most;
}

// A circle about the z axis.
std::vector<Vector3> ring(double radius, double height) {
  std::vector<Vector3> points;
  for (int i = 0; i < 720; ++i) {
    points.emplace_back(radius * std::cos(i * pi / 360.0), radius * std::sin(i * pi / 360.0), height);
  }
  return points;
}

TEST(Reach, IsThatOfTheFarthestPointOfEachShape) {
  const Vector3 from(0.3, 0.2, -0.1);
  const std::vector<Vector3> corners = brick({0.4, 0.2, 0.6}).points;
  EXPECT_NEAR(reach_from(Box{{0.4, 0.2, 0.6}}, from), farthest(corners, from), 1e-15);
  EXPECT_NEAR(reach_from(ConvexHull{corners}, from), farthest(corners, from), 1e-15);
  EXPECT_NEAR(reach_from(Sphere{0.5}, from), 0.5 + from.norm(), 1e-15);
  std::vector<Vector3> rims = ring(0.3, 0.4);
  for (const Vector3& point : ring(0.3, -0.4)) rims.push_back(point);
  EXPECT_NEAR(reach_from(Cylinder{0.3, 0.8}, from), farthest(rims, from), 1e-5);
  EXPECT_NEAR(reach_from(Capsule{0.1, 0.8}, from), 0.1 + (Vector3(0.0, 0.0, 0.4) - from).norm(), 1e-15);
  EXPECT_EQ(reach_from(Plane{}, from), infinity);
}

TEST(Reach, OfACompoundIsThatOfThePartThatGoesFarthest) {
  const Vector3 at(1.0, 0.0, 0.0);
  const Compound pair{{{Sphere{0.2}}, {Box{{0.4, 0.2, 0.6}}, {at, oblique}}}};
  std::vector<Vector3> corners = brick({0.4, 0.2, 0.6}, oblique, at).points;
  EXPECT_NEAR(reach_from(pair, Vector3::Zero()), farthest(corners, Vector3::Zero()), 1e-15);
  EXPECT_NEAR(reach_from(pair, 9.0 * at), 9.2, 1e-15);
  EXPECT_EQ(reach_from(Compound{}, at), 0.0);
}

TEST(Compound, BadPartIsRejectedByItsNumberNameAndValue) {
  const auto with = [](const Part& second) { return [second] { validate(Compound{{{Sphere{0.1}}, second}}); }; };
  EXPECT_TRUE(rejects(with({Sphere{-0.1}}), {"parts[1]", "radius", "-0.1", "above 0"}));
  EXPECT_TRUE(rejects(with({brick({1.0, 1.0, 0.0})}), {"parts[1]", "points", "flat"}));
  EXPECT_TRUE(rejects(with({Sphere{0.1}, {{0.0, nan, 0.0}}}), {"parts[1]", "position", "nan", "finite"}));
  Part turned{Sphere{0.1}};
  turned.pose.orientation.coeffs() << 0.0, 0.0, 0.0, 1.1;
  EXPECT_TRUE(rejects(with(turned), {"parts[1]", "orientation", "1.1", "unit quaternion"}));
}

TEST(Compound, SolidThatNoRigidBodyCanHaveIsRejectedByNameAndValue) {
  const auto with = [](const MassProperties& solid) { return [solid] { validate(Compound{{{Sphere{0.1}}}, solid}); }; };
  const Vector3 fine(1.0, 1.0, 1.0);
  EXPECT_NO_THROW(with({0.1, Vector3::Zero(), {1.0, 2.0, 3.0}})());
  EXPECT_TRUE(rejects(with({0.0, Vector3::Zero(), fine}), {"solid: volume", "0", "above 0"}));
  EXPECT_TRUE(rejects(with({0.1, {nan, 0.0, 0.0}, fine}), {"solid: center", "nan", "finite"}));
  EXPECT_TRUE(rejects(with({0.1, Vector3::Zero(), {1.0, 2.0, 3.1}}), {"solid: moments", "(1, 2, 3.1)", "sum"}));
  EXPECT_TRUE(rejects(with({0.1, Vector3::Zero(), {1.0, 0.0, 1.0}}), {"solid: moments", "(1, 0, 1)", "above 0"}));
  EXPECT_TRUE(rejects(with({0.1, Vector3::Zero(), fine, Quaternion(2.0, 0.0, 0.0, 0.0)}), {"solid: axes", "2"}));
}

}  // namespace
}  // namespace energymargin

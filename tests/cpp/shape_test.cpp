// Shapes: mass properties against closed forms, and what is no shape.

#include "energymargin/shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// The inertia about the shape's own axes.
Eigen::Matrix3d tensor(const MassProperties& mass) {
  const Eigen::Matrix3d axes = mass.axes.toRotationMatrix();
  return axes * mass.moments.asDiagonal() * axes.transpose();
}

// A body of revolution as a stack of discs, by Simpson's rule: exact for the cubic pieces that round shapes have.
MassProperties stack_of_discs(const std::function<double(double)>& radius_squared, double half_length, double mass) {
  constexpr int slices = 20000;
  const double h = 2.0 * half_length / slices;
  MassProperties sum;
  for (int i = 0; i <= slices; ++i) {
    const double z = -half_length + i * h;
    const double weight = h / 3.0 * (i == 0 || i == slices ? 1.0 : (i % 2 == 0 ? 2.0 : 4.0));
    const double square = radius_squared(z);
    sum.volume += weight * pi * square;
    const double across = weight * pi * square * (0.25 * square + z * z);
    sum.moments += Vector3(across, across, weight * 0.5 * pi * square * square);
  }
  sum.moments *= mass / sum.volume;
  return sum;
}

TEST(Shape, BoxSphereAndCylinderHaveTheMassPropertiesOfTheirFormulas) {
  const MassProperties box = mass_properties(Box{{1.0, 2.0, 3.0}}, 12.0);
  EXPECT_NEAR(box.volume, 6.0, 1e-12);
  EXPECT_TRUE(box.moments.isApprox(Vector3(13.0, 10.0, 5.0), 1e-14));
  const MassProperties sphere = mass_properties(Sphere{0.3}, 5.0);
  EXPECT_NEAR(sphere.volume, 4.0 / 3.0 * pi * 0.027, 1e-14);
  EXPECT_TRUE(sphere.moments.isApprox(Vector3::Constant(0.4 * 5.0 * 0.09), 1e-14));
  const MassProperties cylinder = mass_properties(Cylinder{0.2, 0.6}, 3.0);
  EXPECT_NEAR(cylinder.volume, pi * 0.04 * 0.6, 1e-14);
  EXPECT_TRUE(cylinder.moments.isApprox(Vector3(0.12, 0.12, 0.06), 1e-14));
}

TEST(Shape, CapsuleHasTheMassPropertiesOfItsSlices) {
  const double r = 0.2;
  const double h = 0.5;
  const MassProperties expected = stack_of_discs(
      [=](double z) {
        const double into_cap = std::max(std::abs(z) - 0.5 * h, 0.0);
        return r * r - into_cap * into_cap;
      },
      0.5 * h + r, 3.0);
  const MassProperties capsule = mass_properties(Capsule{r, h}, 3.0);
  EXPECT_NEAR(capsule.volume, expected.volume, 1e-8);
  EXPECT_TRUE(capsule.moments.isApprox(expected.moments, 1e-7)) << capsule.moments.transpose();
}

TEST(Shape, HullOfATurnedBrickEqualsTheTurnedBox) {
  const Vector3 size(0.3, 0.7, 1.1);
  const Quaternion turned = turn(0.8, Vector3(1.0, 2.0, -0.5).normalized());
  const MassProperties box = mass_properties(Box{size}, 2.5);
  ConvexHull hull = brick(size, turned);
  hull.points.emplace_back(0.01, 0.02, 0.03);  // inside: changes nothing
  hull.points.push_back(hull.points.front());
  const MassProperties same = mass_properties(hull, 2.5);
  EXPECT_NEAR(same.volume, box.volume, 1e-12);
  EXPECT_LT(same.center.norm(), 1e-12);
  const Eigen::Matrix3d rotation = turned.toRotationMatrix();
  EXPECT_TRUE(tensor(same).isApprox(rotation * box.moments.asDiagonal() * rotation.transpose(), 1e-12));
  EXPECT_NEAR(smallest_half_extent(hull), 0.15, 1e-12);
}

TEST(Shape, RegularTetrahedronHasTheInertiaOfItsFormula) {
  const ConvexHull hull{{{1.0, 1.0, 1.0}, {1.0, -1.0, -1.0}, {-1.0, 1.0, -1.0}, {-1.0, -1.0, 1.0}}};
  const MassProperties tetrahedron = mass_properties(hull, 3.0);
  const double edge_squared = 8.0;
  EXPECT_NEAR(tetrahedron.volume, 8.0 / 3.0, 1e-12);
  EXPECT_TRUE(tetrahedron.moments.isApprox(Vector3::Constant(3.0 * edge_squared / 20.0), 1e-12));
}

TEST(Shape, CenteredMovesTheCentreOfMassToTheOriginAndNothingElse) {
  const Vector3 moved(0.4, -0.2, 5.0);
  const ConvexHull off = brick({0.3, 0.7, 1.1}, turn(0.4, Vector3::UnitX()), moved);
  const MassProperties before = mass_properties(off, 2.0);
  const MassProperties after = mass_properties(centered(off), 2.0);
  EXPECT_TRUE(before.center.isApprox(moved, 1e-12));
  EXPECT_LT(after.center.norm(), 1e-12);
  EXPECT_TRUE(tensor(after).isApprox(tensor(before), 1e-10));
}

TEST(Shape, PlaneHasNoMassAndNoExtent) {
  EXPECT_EQ(mass_properties(Plane{}, 1.0).volume, 0.0);
  EXPECT_EQ(smallest_half_extent(Plane{}), infinity);
}

TEST(Shape, SmallestHalfExtentIsThatOfTheThinnestSide) {
  EXPECT_EQ(smallest_half_extent(Box{{3.0, 1.0, 2.0}}), 0.5);
  EXPECT_EQ(smallest_half_extent(Sphere{0.3}), 0.3);
  EXPECT_EQ(smallest_half_extent(Cylinder{0.3, 0.4}), 0.2);
  EXPECT_EQ(smallest_half_extent(Cylinder{0.1, 0.4}), 0.1);
  EXPECT_EQ(smallest_half_extent(Capsule{0.1, 0.01}), 0.1);
}

TEST(Shape, SizesThatAreNoSizesAreRejectedByNameAndValue) {
  EXPECT_TRUE(rejects([] { validate(Box{{1.0, 0.0, 1.0}}); }, {"size", "(1, 0, 1)", "above 0"}));
  EXPECT_TRUE(rejects([] { validate(Box{{1.0, nan, 1.0}}); }, {"size", "nan", "finite"}));
  EXPECT_TRUE(rejects([] { validate(Sphere{-0.1}); }, {"radius", "-0.1", "above 0"}));
  EXPECT_TRUE(rejects([] { validate(Cylinder{0.1, infinity}); }, {"length", "inf", "finite"}));
  EXPECT_TRUE(rejects([] { validate(Capsule{0.1, 0.0}); }, {"length", "0", "above 0"}));
  EXPECT_TRUE(rejects([] { validate(Plane{{0.0, 0.0, 2.0}, 0.0}); }, {"normal", "(0, 0, 2)", "length 1"}));
}

TEST(Shape, HullWithoutVolumeIsRejected) {
  EXPECT_TRUE(rejects([] { validate(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}); }, {"points", "3", "at least 4"}));
  EXPECT_TRUE(rejects([] { validate(brick({1.0, 1.0, 0.0})); }, {"points", "flat"}));
  EXPECT_TRUE(rejects([] { validate(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, nan}}}); }, {"points", "nan"}));
}

}  // namespace
}  // namespace energymargin

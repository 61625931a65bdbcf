// Contacts of faces and lines that lie on one another: on the corners that they share, as deep as the solids overlap.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "physics/contacts/face_contacts.hpp"

namespace energymargin {
namespace {

constexpr double margin = 0.001;
constexpr double depth = 0.002;  // of corners that count
const btQuaternion unturned = btQuaternion::getIdentity();

btQuaternion about(const btVector3& axis, double angle) { return btQuaternion(axis.normalized(), angle); }

// A hull with its margin inside.
HullShape hull_of(const std::vector<btVector3>& points) {
  std::vector<Vector3> corners;
  for (const btVector3& point : points) corners.emplace_back(point.x(), point.y(), point.z());
  return HullShape(corners, margin);
}

HullShape brick_of(const btVector3& half) {
  std::vector<btVector3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(half * btVector3(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0));
  }
  return hull_of(corners);
}

struct Point {
  btVector3 normal, on_b;
  double distance;
};

// Of the upper solid `a` on the lower one `b`, along the normal between them or, if it is given, along that one.
std::vector<Point> face_points(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                               const btTransform& pose_b, btVector3 normal = {0.0, 0.0, 0.0}) {
  SolidPair solids(a, b);
  if (normal.isZero()) normal = solids.closest(pose_a, pose_b, depth).value().normal;
  FaceContacts faces;
  std::vector<Point> points;
  for (const FacePoint& point : faces.find(solids, pose_a, pose_b, normal, {depth, 0.0, false})) {
    points.push_back({normal, point.on_b, point.distance});
  }
  return points;
}

// The farthest point of a solid along a direction. Bullet rounds the rim of a cylinder.
btVector3 farthest(const btConvexShape& shape, const btVector3& direction) {
  if (shape.getShapeType() != CYLINDER_SHAPE_PROXYTYPE) return shape.localGetSupportingVertex(direction);
  const btVector3 half = static_cast<const btCylinderShape&>(shape).getHalfExtentsWithMargin();
  const double across = std::max(std::hypot(direction.x(), direction.y()), 1e-300);
  const double end = direction.z() < 0.0 ? -half.z() : half.z();
  return {half.x() * direction.x() / across, half.x() * direction.y() / across, end};
}

// How far the solids are apart along a normal.
double gap(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b, const btTransform& pose_b,
           const btVector3& normal) {
  const btVector3 on_a = pose_a(farthest(a, -normal * pose_a.getBasis()));
  const btVector3 on_b = pose_b(farthest(b, normal * pose_b.getBasis()));
  return normal.dot(on_a - on_b);
}

btTransform at(const btVector3& position, const btQuaternion& turn = unturned) { return btTransform(turn, position); }

TEST(FaceContact, CubeOnACubeTouchesAtTheFourCornersThatTheyShareAtTheirDepth) {
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const double height = 0.1 - 0.0003;
  const std::vector<Point> points = face_points(cube, at({0.02, 0.03, height}), cube, at({0.0, 0.0, 0.0}));
  ASSERT_EQ(points.size(), 4U);
  for (const double x : {-0.03, 0.05}) {
    for (const double y : {-0.02, 0.05}) {
      EXPECT_EQ(
          std::count_if(points.begin(), points.end(),
                        [&](const Point& point) { return (point.on_b - btVector3(x, y, 0.05)).length() < 1e-12; }),
          1)
          << x << ", " << y;
    }
  }
  for (const Point& point : points) EXPECT_NEAR(point.distance, -0.0003, 1e-12);
}

TEST(FaceContact, CubeOnACubeThatIsTurnedBy45DegreesTouchesAtEightCorners) {
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const btTransform upper = at({0.0, 0.0, 0.1 - 0.0003}, about({0.0, 0.0, 1.0}, 0.25 * SIMD_PI));
  const std::vector<Point> points = face_points(cube, upper, cube, at({0.0, 0.0, 0.0}));
  EXPECT_EQ(points.size(), 8U);
  for (const Point& point : points) {
    EXPECT_NEAR(point.on_b.absolute()[point.on_b.absolute().maxAxis()], 0.05, 1e-12);
    EXPECT_NEAR(std::hypot(point.on_b.x(), point.on_b.y()), 0.05 / std::cos(SIMD_PI / 8.0), 1e-12);
    EXPECT_NEAR(point.distance, -0.0003, 1e-12);
  }
}

// The edge is as wide as the cube, and sharp.
TEST(FaceContact, EdgeOnAFaceTouchesAtItsTwoEnds) {
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const double height = 0.05 * std::sqrt(2.0) + 0.05 - 0.0003;
  const btTransform upper = at({0.02, 0.0, height}, about({1.0, 0.0, 0.0}, 0.25 * SIMD_PI));
  std::vector<Point> points = face_points(cube, upper, cube, at({0.0, 0.0, 0.0}));
  ASSERT_EQ(points.size(), 2U);
  if (points[0].on_b.x() > points[1].on_b.x()) std::swap(points[0], points[1]);
  EXPECT_LT((points[0].on_b - btVector3(-0.03, 0.0, 0.05)).length(), 1e-12);
  EXPECT_LT((points[1].on_b - btVector3(0.05, 0.0, 0.05)).length(), 1e-12);
  for (const Point& point : points) EXPECT_NEAR(point.distance, -0.0003, 1e-12);
}

TEST(FaceContact, CylinderThatLiesOnAFaceTouchesAtTheEndsOfALine) {
  btCylinderShapeZ cylinder(btVector3(0.03, 0.03, 0.04));
  cylinder.setMargin(margin);
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const btTransform lying = at({0.02, 0.01, 0.08 - 0.0003}, about({0.0, 1.0, 0.0}, 0.5 * SIMD_PI));
  std::vector<Point> points = face_points(cylinder, lying, cube, at({0.0, 0.0, 0.0}));
  ASSERT_EQ(points.size(), 2U);
  if (points[0].on_b.x() > points[1].on_b.x()) std::swap(points[0], points[1]);
  EXPECT_LT((points[0].on_b - btVector3(-0.02, 0.01, 0.05)).length(), 1e-9);
  EXPECT_LT((points[1].on_b - btVector3(0.05, 0.01, 0.05)).length(), 1e-9);
  for (const Point& point : points) EXPECT_NEAR(point.distance, -0.0003, 1e-9);
}

// Two wedges, their edges up and down.
TEST(FaceContact, EdgesThatCrossTouchWhereTheyDo) {
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const double height = 0.1 * std::sqrt(2.0) - 0.0003;
  const btQuaternion on_edge = about({1.0, 0.0, 0.0}, 0.25 * SIMD_PI);
  for (const double angle : {0.1, 0.7, 0.5 * SIMD_PI}) {
    const btTransform upper = at({0.0, 0.0, height}, about({0.0, 0.0, 1.0}, angle) * on_edge);
    const std::vector<Point> points = face_points(cube, upper, cube, at({0.0, 0.0, 0.0}, on_edge));
    ASSERT_EQ(points.size(), 1U) << angle;
    EXPECT_NEAR(points.front().distance, -0.0003, 1e-9) << angle;
    EXPECT_LT((points.front().on_b - btVector3(0.0, 0.0, 0.05 * std::sqrt(2.0))).length(), 1e-9) << angle;
  }
  EXPECT_EQ(face_points(cube, at({0.03, 0.0, height}, on_edge), cube, at({0.0, 0.0, 0.0}, on_edge)).size(), 2U);
}

// Its back is so near that its corners could be taken for those of its face.
TEST(FaceContact, ThinPlateTouchesWithItsFaceAndNotWithItsBack) {
  const HullShape plate = brick_of({0.05, 0.05, 0.0005});
  const HullShape cube = brick_of({0.1, 0.1, 0.1});
  for (const double tilt : {0.0, 1e-6, 0.001, 0.003}) {
    const btTransform upper = at({0.0, 0.0, 0.1005 + 0.05 * tilt - 0.0003}, about({0.0, 1.0, 0.0}, tilt));
    const std::vector<Point> points = face_points(plate, upper, cube, at({0.0, 0.0, 0.0}), {0.0, 0.0, 1.0});
    EXPECT_EQ(points.size(), 4U) << tilt;
    for (const Point& point : points) {
      EXPECT_NEAR(point.distance, point.on_b.x() > 0.0 ? -0.0003 : -0.0003 + 0.1 * tilt, 2e-6) << tilt;
    }
  }
}

// An edge as short as that is a line without a length along the normal.
TEST(FaceContact, EdgeAlongTheNormalIsAPoint) {
  const HullShape pillar =
      hull_of({{0.0, 0.0, 0.0}, {0.0, 0.0, 0.001}, {0.05, 0.0, 0.05}, {-0.05, 0.04, 0.05}, {-0.05, -0.04, 0.05}});
  const HullShape stalagmite =
      hull_of({{0.0, 0.0, 0.0}, {0.0, 0.0, -0.001}, {0.05, 0.0, -0.05}, {-0.05, 0.04, -0.05}, {-0.05, -0.04, -0.05}});
  const HullShape cube = brick_of({0.05, 0.05, 0.05});
  const btTransform upper = at({0.0, 0.0, -0.0003});
  for (const HullShape* lower : {&stalagmite, &cube}) {
    const btTransform below = at({0.0, 0.0, lower == &cube ? -0.05 : 0.0});
    for (const Point& point : face_points(pillar, upper, *lower, below, {0.0, 0.0, 1.0})) {
      EXPECT_NEAR(point.distance, -0.0003, 1e-12);
    }
    for (const Point& point : face_points(cube, at({0.0, 0.0, 0.05 - 0.0003}), *lower, below, {0.0, 0.0, 1.0})) {
      EXPECT_NEAR(point.distance, -0.0003, 1e-12);
    }
  }
}

// Hulls of many corners, also in a line and above each other, boxes, cylinders and capsules, that lie on one another
// with a tilt.
TEST(FaceContact, NoPointIsDeeperThanTheSolidsOverlap) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto cloud = [&](int corners, double share) {
    std::vector<btVector3> points;
    for (int i = 0; i < corners; ++i) {
      const double z = even(random) > 0.0 ? 0.02 : -0.02;
      points.emplace_back(0.05 * even(random), 0.05 * even(random), z * (1.0 + share * even(random)));
      if (i % 4 == 1) points.push_back(0.5 * (points[0] + points[1]));
      if (i % 4 == 2) points.push_back(points.back() * btVector3(1.0, 1.0, 0.98));
    }
    return hull_of(points);
  };
  btCylinderShapeZ cylinder(btVector3(0.03, 0.03, 0.04));
  cylinder.setMargin(margin);
  btCapsuleShapeZ capsule(0.02, 0.06);
  btBoxShape box(btVector3(0.04, 0.05, 0.02));
  box.setMargin(margin);
  int found = 0;
  for (int i = 0; i < 5000; ++i) {
    const HullShape first = cloud(20, 0.05 * (i % 3)), second = cloud(12, 0.05 * (i % 2));
    const std::vector<const btConvexShape*> shapes{&first, &cylinder, &capsule, &box};
    const btConvexShape& upper = *shapes[std::size_t(i) % 4];
    const btQuaternion turned = about({even(random), even(random), even(random)}, 0.05 * even(random));
    const btQuaternion side = i % 3 == 0 ? about({0.0, 1.0, 0.0}, 0.5 * SIMD_PI) : unturned;
    btTransform pose = at({0.03 * even(random), 0.03 * even(random), 0.0}, turned * side);
    const btTransform below = at({0.0, 0.0, 0.0});
    const btVector3 normal = btVector3(0.01 * even(random), 0.01 * even(random), 1.0).normalized();
    const double overlap = 0.001 * (1.0 + even(random));
    pose.getOrigin() -= normal * (gap(upper, pose, second, below, normal) + overlap) / normal.dot(normal);
    for (const Point& point : face_points(upper, pose, second, below, normal)) {
      ++found;
      EXPECT_GE(point.distance, -overlap - 1e-12) << i;
      EXPECT_LE(point.distance, depth) << i;
      EXPECT_LT(std::hypot(point.on_b.x(), point.on_b.y()), 0.075) << i;
    }
  }
  EXPECT_GT(found, 5000);
}

}  // namespace
}  // namespace energymargin

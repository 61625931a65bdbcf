// Closest points of two convex solids without their margins, found anew and from the last ones.

#include "physics/contacts/solid_pair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace energymargin {
namespace {

constexpr double any_reach = 1e18;

// Solids of 2 to 20 cm and their poses.
class Draw {
 public:
  double even(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  std::unique_ptr<btConvexShape> solid(int kind) {
    const double radius = even(0.01, 0.1), half = even(0.01, 0.1);
    std::unique_ptr<btConvexShape> shape;
    switch (kind) {
      case 0:
        shape = std::make_unique<btBoxShape>(btVector3(radius, even(0.01, 0.1), half));
        break;
      case 1:
        shape = std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, half));
        break;
      case 2:
        return std::make_unique<btCapsuleShapeZ>(radius, 2.0 * half);
      case 3:
        return std::make_unique<btSphereShape>(radius);
      default: {
        std::vector<Vector3> corners(4 + static_cast<std::size_t>(even(0.0, 40.0)));
        for (Vector3& corner : corners) {
          corner = {even(-radius, radius), even(-radius, radius), even(-half, half)};
        }
        return std::make_unique<HullShape>(corners, 0.0005);
      }
    }
    shape->setMargin(0.0005);
    return shape;
  }

  //! From -most to most.
  int whole(int most) { return std::uniform_int_distribution<int>(-most, most)(random_); }

  btVector3 within(double extent) { return {even(-extent, extent), even(-extent, extent), even(-extent, extent)}; }

  btQuaternion turn(double angle) { return btQuaternion(within(1.0).normalized(), angle); }

  btTransform pose() { return btTransform(turn(even(-SIMD_PI, SIMD_PI)), within(0.2)); }

  btTransform moved(const btTransform& pose) {
    return btTransform(turn(even(0.0, 0.05)) * pose.getRotation(), pose.getOrigin() + within(0.005));
  }

 private:
  std::mt19937_64 random_{1};
};

// How far two cores are apart along a normal: no more than their distance.
double gap(const SolidPair& pair, const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal) {
  return normal.dot(pose_a(pair.a().support(-normal * pose_a.getBasis())) -
                    pose_b(pair.b().support(normal * pose_b.getBasis())));
}

// Whether a core has a point, as far as one can tell.
bool has(const btConvexShape& shape, const btTransform& pose, const btVector3& point) {
  const btSphereShape dot(0.0);
  const btTransform place(btQuaternion::getIdentity(), point);
  ClosestPoints found;
  constexpr double rounding = 5e-7;
  return SolidPair(dot, shape).inner_distance(place, pose, any_reach, found) == Separation::too_near ||
         found.distance < rounding;
}

// Calls `visit` with pairs of every two kinds of solids, each at four poses that are near each other.
template <typename Visit>
void for_pairs(int of_each, const Visit& visit) {
  Draw draw;
  for (int kinds = 0; kinds < 25; ++kinds) {
    for (int i = 0; i < of_each; ++i) {
      const auto a = draw.solid(kinds / 5), b = draw.solid(kinds % 5);
      SolidPair pair(*a, *b);
      btTransform pose_a = draw.pose();
      const btTransform pose_b = draw.pose();
      for (int motion = 0; motion < 4; ++motion) {
        visit(pair, *a, pose_a, *b, pose_b);
        pose_a = draw.moved(pose_a);
      }
    }
  }
}

bool side_by_side(const SolidPair& pair, const btTransform& pose_a, const btTransform& pose_b) {
  return distance_side_by_side(pair.a(), pose_a, pair.b(), pose_b).has_value();
}

// Proved from both sides: a plane across the normal is between the cores, so they are no nearer; each has one of the
// points, so they are no farther.
TEST(InnerDistance, IsTheGapAlongItsNormalAnewAndFromTheLastPoints) {
  int apart = 0;
  for_pairs(200, [&](SolidPair& pair, const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                     const btTransform& pose_b) {
    if (side_by_side(pair, pose_a, pose_b)) return;
    ClosestPoints found;
    if (pair.inner_distance(pose_a, pose_b, any_reach, found) != Separation::apart) return;
    ++apart;
    EXPECT_NEAR(found.normal.length(), 1.0, 1e-12);
    EXPECT_NEAR(found.distance, gap(pair, pose_a, pose_b, found.normal), 1e-9);
    EXPECT_TRUE(has(a, pose_a, found.on_b + found.distance * found.normal));
    EXPECT_TRUE(has(b, pose_b, found.on_b));
    SolidPair anew = pair;
    anew.forget();
    ClosestPoints again;
    ASSERT_EQ(anew.inner_distance(pose_a, pose_b, any_reach, again), Separation::apart);
    EXPECT_NEAR(again.distance, found.distance, 1e-9);
    EXPECT_LT((again.normal - found.normal).length(), 2e-4 + 3e-8 / found.distance);
  });
  EXPECT_GT(apart, 15000);
}

TEST(InnerDistance, IsTooFarExactlyWhereItIsAboveItsReach) {
  for_pairs(100, [](SolidPair& pair, const btConvexShape&, const btTransform& pose_a, const btConvexShape&,
                    const btTransform& pose_b) {
    ClosestPoints known, found;
    SolidPair anew = pair;
    if (anew.inner_distance(pose_a, pose_b, any_reach, known) != Separation::apart) return;
    EXPECT_EQ(pair.inner_distance(pose_a, pose_b, known.distance * (1.0 - 1e-5), found), Separation::too_far);
    ASSERT_EQ(pair.inner_distance(pose_a, pose_b, known.distance * (1.0 + 1e-5), found), Separation::apart);
    EXPECT_NEAR(found.distance, known.distance, 1e-9);
  });
}

TEST(InnerDistance, SolidsWithTheSameCentreAreTooNear) {
  Draw draw;
  const btTransform pose = draw.pose();
  for (int kinds = 0; kinds < 25; ++kinds) {
    if (kinds / 5 == 4 || kinds % 5 == 4) continue;  // a hull's centre may be outside
    const auto a = draw.solid(kinds / 5), b = draw.solid(kinds % 5);
    SolidPair pair(*a, *b);
    ClosestPoints found;
    for (const double aside : {0.0, 1e-300, 1e-12}) {
      btTransform other = pose;
      other.getOrigin() += btVector3(aside, 0.0, 0.0);
      EXPECT_EQ(pair.inner_distance(pose, other, any_reach, found), Separation::too_near) << kinds << ", " << aside;
    }
  }
}

// What is farthest is found several points at a time; of equals the first one counts.
TEST(HullShape, FindsTheFirstOfItsFarthestPoints) {
  Draw draw;
  for (std::size_t count = 1; count < 60; ++count) {
    std::vector<btVector3> points(count);
    for (btVector3& point : points) point = btVector3(draw.whole(3), draw.whole(3), draw.whole(3));  // many are equal
    const HullShape hull(HullShape::Hull{points, points});
    for (int i = 0; i < 20; ++i) {
      const btVector3 direction = i % 2 ? draw.within(1.0) : btVector3(draw.whole(3), draw.whole(3), draw.whole(3));
      const auto nearer = [&](const btVector3& a, const btVector3& b) { return direction.dot(a) < direction.dot(b); };
      const auto first = std::max_element(points.begin(), points.end(), nearer);
      EXPECT_EQ(&hull.farthest_point(direction) - hull.getUnscaledPoints(), first - points.begin()) << count;
    }
  }
}

// Of parallel faces, of edges, and of needles that are as good as flat.
TEST(InnerDistance, OfSolidsInLineIsWhatIsBetweenThem) {
  const auto shape = [](int kind, const btVector3& half) -> std::unique_ptr<btConvexShape> {
    std::unique_ptr<btConvexShape> made = std::make_unique<btBoxShape>(half);
    if (kind == 1) made = std::make_unique<btCylinderShapeZ>(btVector3(half.x(), half.x(), half.z()));
    if (kind == 2) {
      std::vector<btVector3> corners;
      for (int i = 0; i < 8; ++i) {
        const btVector3 corner(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
        for (const double share : {1.0, 1.0 - 1e-9, 0.5}) {  // corners in a line, and all but the same
          corners.push_back(half * corner * btVector3(share, 1.0, 1.0));
        }
      }
      made = std::make_unique<HullShape>(HullShape::Hull{corners, corners});
    }
    made->setMargin(0.0);
    return made;
  };
  const btQuaternion turned = btQuaternion(btVector3(0.3, -0.5, 0.8).normalized(), 1.3);
  for (const btVector3& half : {btVector3(0.05, 0.05, 0.05), btVector3(1e-6, 1e-6, 0.1), btVector3(0.1, 0.1, 1e-6)}) {
    for (int kinds = 0; kinds < 9; ++kinds) {
      const auto a = shape(kinds / 3, half), b = shape(kinds % 3, half);
      SolidPair pair(*a, *b);
      for (const double away : {1e-4, 0.01, 1.0, 100.0}) {
        const btTransform frame(turned, btVector3(0.1, 0.2, 0.3));
        const btTransform above = frame * btTransform(btQuaternion::getIdentity(), {0.0, 0.0, 2.0 * half.z() + away});
        ClosestPoints found;
        ASSERT_EQ(pair.inner_distance(above, frame, any_reach, found), Separation::apart) << kinds << ", " << away;
        EXPECT_NEAR(found.distance, away, 1e-9 * away + 1e-13) << kinds;
        EXPECT_LT((found.normal - frame.getBasis().getColumn(2)).length(), 1e-4) << kinds << ", " << away;
      }
    }
  }
}

// ---- cylinders side by side

struct Errors {
  double distance = 0.0;  // [m]
  double normal = 0.0;    // [rad]
};

// A cylinder as a prism, which no closed form is asked about.
HullShape prism_of(double radius, double half) {
  constexpr int sides = 1000;
  std::vector<btVector3> corners;
  for (int i = 0; i < 2 * sides; ++i) {
    const double angle = SIMD_2_PI * i / (2 * sides);
    corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle), i % 2 ? half : -half);
  }
  return HullShape(HullShape::Hull{corners, corners});
}

// The largest of cylinders that stand beside a box or another cylinder, so much tilted and so much longer than thick.
Errors errors_side_by_side(double tilt, bool box, double slenderness) {
  Draw draw;
  Errors worst;
  int counted = 0;
  for (int i = 0; i < 100; ++i) {
    const double radius = draw.even(0.003, 0.03), other = draw.even(0.003, 0.03), across = draw.even(0.003, 0.03);
    btCylinderShapeZ cylinder(btVector3(radius, radius, slenderness * radius));
    const btVector3 half(other, box ? across : other, draw.even(0.3, 1.5) * slenderness * radius);
    std::unique_ptr<btConvexShape> standing = std::make_unique<btBoxShape>(half);
    if (!box) standing = std::make_unique<btCylinderShapeZ>(half);
    cylinder.setMargin(0.0);
    standing->setMargin(0.0);

    const double angle = draw.even(0.0, 0.5 * SIMD_PI), away = radius + draw.even(1e-4, 0.005);
    btVector3 place(std::cos(angle) * (other + away), std::sin(angle) * (other + away), 0.0);
    if (box && i % 2 == 0) place = {other + away, draw.even(-across, across), 0.0};
    if (box && i % 2 == 1) place = {other + away * std::cos(angle), across + away * std::sin(angle), 0.0};
    place.setZ(draw.even(-0.8, 0.8) * (slenderness * radius + half.z()));
    const double toward = draw.even(-SIMD_PI, SIMD_PI);
    const btQuaternion tilted(btVector3(std::cos(toward), std::sin(toward), 0.0), tilt);
    const btTransform pose_b = draw.pose();
    const btTransform pose_a = pose_b * btTransform(tilted, place);

    const SolidPair pair(cylinder, *standing);
    const auto found = distance_side_by_side(pair.a(), pose_a, pair.b(), pose_b);
    const HullShape prism = prism_of(radius, slenderness * radius);
    ClosestPoints expected;
    if (SolidPair(prism, *standing).inner_distance(pose_a, pose_b, any_reach, expected) != Separation::apart || !found)
      continue;
    ++counted;
    worst.distance = std::max(worst.distance, std::abs(found->distance - expected.distance));
    worst.normal = std::max(worst.normal, double((found->normal - expected.normal).length()));
  }
  EXPECT_GT(counted, 60);
  return worst;
}

// The prism is thinner by up to 0.2 um, and its normals are up to 3 mrad off.
TEST(InnerDistance, OfCylindersSideBySideIsWithinAFewMicrometresUpToATiltOfAHundredth) {
  for (const double slenderness : {1.0, 3.0, 30.0}) {
    for (const bool box : {false, true}) {
      EXPECT_LT(errors_side_by_side(0.0, box, slenderness).distance, 2e-7) << slenderness << ", " << box;
      for (const double tilt : {0.001, 0.0099}) {
        const Errors errors = errors_side_by_side(tilt, box, slenderness);
        EXPECT_LT(errors.distance, slenderness > 10.0 ? 8e-6 : 2e-6) << slenderness << ", " << box << ", " << tilt;
        EXPECT_LT(errors.normal, 0.0035 + (slenderness > 10.0 ? 3.0 : 1.0) * tilt)
            << slenderness << ", " << box << ", " << tilt;
      }
    }
  }
}

TEST(InnerDistance, OfABoxAndACylinderBesideItIsTheSameInEitherOrder) {
  Draw draw;
  btCylinderShapeZ cylinder(btVector3(0.02, 0.02, 0.05));
  btBoxShape box(btVector3(0.03, 0.04, 0.05));
  for (int i = 0; i < 200; ++i) {
    const btTransform of_box = draw.pose();
    const btTransform of_cylinder = of_box * btTransform(draw.turn(draw.even(0.0, 0.003)),
                                                         {0.06 + draw.even(0.0, 0.01), draw.even(-0.06, 0.06), 0.0});
    const SolidPair pair(cylinder, box);
    const auto there = distance_side_by_side(pair.a(), of_cylinder, pair.b(), of_box);
    const auto back = distance_side_by_side(pair.b(), of_box, pair.a(), of_cylinder);
    ASSERT_TRUE(there && back);
    EXPECT_EQ(there->distance, back->distance);
    EXPECT_EQ(there->normal, -back->normal);
    EXPECT_LT((there->on_b + there->normal * there->distance - back->on_b).length(), 1e-12);
  }
}

// One within the other, on one axis, one above the other, of no common height.
TEST(InnerDistance, OfCylindersThatAreNotBesideEachOtherHasNoClosedForm) {
  btCylinderShapeZ cylinder(btVector3(0.02, 0.02, 0.05));
  btBoxShape box(btVector3(0.03, 0.04, 0.05));
  const btTransform frame = btTransform::getIdentity();
  for (const btConvexShape* other : {static_cast<btConvexShape*>(&cylinder), static_cast<btConvexShape*>(&box)}) {
    const SolidPair pair(cylinder, *other);
    for (const btVector3& place : {btVector3(0.0, 0.0, 0.0), btVector3(0.0, 0.0, 0.02), btVector3(0.01, 0.0, 0.0),
                                   btVector3(0.0, 0.0, 0.2), btVector3(0.1, 0.0, 0.2)}) {
      const btTransform pose(btQuaternion::getIdentity(), place);
      EXPECT_FALSE(distance_side_by_side(pair.a(), pose, pair.b(), frame).has_value())
          << place.x() << ", " << place.z();
    }
  }
}

}  // namespace
}  // namespace energymargin

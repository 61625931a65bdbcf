// Contacts of the pieces of two bodies: all of them count, as the bodies stand.

#include <gtest/gtest.h>

#include <set>

#include "physics/bodies/moving_bodies.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A box of 20 cm that hangs `distance` above another one or above a plane, with the same friction.
std::vector<ContactPoint> points_of(const Shape& ground, double top, double distance) {
  Scene scene;
  scene.add_body(fixed("ground", ground));
  scene.add_body(body("box", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, top + 0.1 + distance}, Role::object));
  scene.set_friction({"ground", "box", 0.05});
  MovingBodies bodies(scene);
  bodies.restore(pack(scene));
  CollisionPairs pairs(scene, bodies.poses());
  pairs.update(std::vector<Velocity>(scene.bodies().size()), scene.stepping().step);
  return pairs.points();
}

TEST(Contacts, PointsHaveTheirPlaceOnBothBodiesAndTheFrictionOfThePair) {
  for (const ContactPoint& point : points_of(Box{{0.2, 0.2, 0.2}}, 0.1, -0.001)) {
    EXPECT_EQ(point.a, 0U);
    EXPECT_EQ(point.b, 1U);
    EXPECT_NEAR(point.distance, -0.001, 1e-9);
    EXPECT_NEAR(point.on_b.z(), 0.099, 1e-9);
    EXPECT_NEAR(point.on_a.z(), 0.1, 1e-9);
    EXPECT_EQ(point.friction, 0.05);
  }
  EXPECT_EQ(points_of(Box{{0.2, 0.2, 0.2}}, 0.1, -0.001).size(), 4U);
}

TEST(Contacts, OfASolidAndAPlaneTheSolidComesFirst) {
  const std::vector<ContactPoint> points = points_of(Plane{}, 0.0, -0.001);
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points.front().a, 1U);
  EXPECT_EQ(points.front().b, 0U);
}

TEST(Contacts, PointThatIsTooFarIsNone) { EXPECT_TRUE(points_of(Plane{}, 0.0, 0.01).empty()); }

TEST(Contacts, EachPieceOfACompoundMeetsEachOfAnotherOnce) {
  Compound row;
  for (int i = 0; i < 7; ++i) row.parts.push_back({Sphere{0.1}, {{0.3 * i, 0.0, 0.0}}});
  Scene scene;
  scene.add_body(body("row", row, 1.0, {0.0, 0.0, 0.0}, Role::object));
  scene.add_body(body("ball", Sphere{0.1}, 1.0, {0.0, 0.0, 9.0}));
  const CollisionShape &compound = scene.collision_shape(0), &ball = scene.collision_shape(1);
  std::set<std::pair<std::size_t, std::size_t>> visited;
  for (const auto& [a, b] : all_pieces(compound, compound)) visited.emplace(a, b);
  EXPECT_EQ(visited.size(), 49U);
  EXPECT_EQ(all_pieces(compound, compound).size(), 49U);
  EXPECT_EQ(all_pieces(compound, ball).size(), 7U);
  EXPECT_TRUE(comes_first(compound, ball));
  EXPECT_FALSE(comes_first(ball, ball));
}

}  // namespace
}  // namespace energymargin

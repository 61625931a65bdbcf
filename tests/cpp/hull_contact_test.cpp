// Contacts of hulls: as deep as they overlap at any size, and on the same corners however they are turned.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"
#include "physics/shapes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// An upright prism over a regular polygon, its frame in the middle.
ConvexHull prism(int corners, double radius, double height) {
  ConvexHull hull;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * pi * i / corners;
    for (const double z : {-0.5, 0.5}) {
      hull.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z * height);
    }
  }
  return hull;
}

BodyState at(const Vector3& position, double yaw) {
  BodyState state;
  state.position = position;
  state.orientation = turn(yaw, Vector3::UnitZ());
  return state;
}

// Random directions and turns, drawn one by one: compilers evaluate arguments in orders of their own.
class Draws {
 public:
  explicit Draws(unsigned seed) : random_(seed) {}

  Vector3 way() {
    Vector3 way;
    for (double& number : way) number = normal_(random_);
    return way.normalized();
  }

  Quaternion turn() {
    Quaternion turn;
    for (double& number : turn.coeffs()) number = normal_(random_);
    return turn.normalized();
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

ConvexHull fingertip(double size, Draws& draws) {
  ConvexHull hull;
  for (int i = 0; i < 150; ++i) hull.points.push_back(size * draws.way().cwiseProduct(Vector3(1.0, 0.7, 0.4)));
  return hull;
}

// Two of them, as shown to a World.
struct TwoHulls {
  Scene scene{Vector3::Zero()};
  std::unique_ptr<World> world;

  TwoHulls(const ConvexHull& hull, double size) {
    scene.add_body(body("object", hull, 1.0, Vector3::Zero(), Role::object));
    scene.add_body(body("other", hull, 1.0, Vector3(3.0 * size, 0.0, 0.0)));
    world = std::make_unique<World>(scene);
  }

  State apart(const Quaternion (&turns)[2], const Vector3& offset) const {
    BodyState states[2];
    for (int k = 0; k < 2; ++k) states[k].orientation = turns[k];
    states[1].position = offset;
    return pack(scene, {{"object", states[0]}, {"other", states[1]}});
  }
};

class HullOfSize : public ::testing::TestWithParam<double> {};

TEST_P(HullOfSize, NoContactIsMuchDeeperThanTwoHullsOverlap) {
  const double size = GetParam();
  Scene scene(Vector3::Zero());
  const ConvexHull wedge = prism(3, size, 0.5 * size);
  scene.add_body(body("object", wedge, 1.0, Vector3::Zero(), Role::object));
  scene.add_body(body("other", wedge, 1.0, Vector3(3.0 * size, 0.0, 0.0)));
  World world(scene);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-pi, pi);
  for (int i = 0; i < 200; ++i) {
    const double direction = angle(random), yaw = angle(random), other_yaw = angle(random);
    const Vector3 way(std::cos(direction), std::sin(direction), 0.0);
    const auto apart = [&](double distance) {
      return pack(scene, {{"object", at(Vector3::Zero(), yaw)}, {"other", at(distance * way, other_yaw)}});
    };
    double near = 0.5 * size, far = 3.0 * size;  // between them the overlap is a hundredth of the size
    while (far - near > 1e-9 * size) {
      const double middle = 0.5 * (near + far);
      (world.distance(apart(middle), "object", "other") < -0.01 * size ? near : far) = middle;
    }
    const State state = apart(far);
    const double overlap = -world.distance(state, "object", "other");
    for (const Contact& contact : world.contacts(state)) {
      EXPECT_LT(-contact.distance, 2.0 * overlap) << "directions " << direction << ", " << yaw << ", " << other_yaw;
    }
  }
}

// As smooth as a fingertip: what two of its faces share is not where it is deepest.
TEST_P(HullOfSize, TouchesAsDeepAsTwoHullsOverlap) {
  const double size = GetParam();
  Draws draws(2);
  const ConvexHull hull = fingertip(size, draws);
  const TwoHulls hulls(hull, size);
  const double margin = 0.05 * smallest_half_extent(hull);
  for (int i = 0; i < 200; ++i) {
    const Vector3 way = draws.way();
    const Quaternion first = draws.turn(), second = draws.turn();
    const auto apart = [&](double distance) { return hulls.apart({first, second}, distance * way); };
    double near = 0.5 * size, far = 3.0 * size;
    while (far - near > 1e-9 * size) {
      const double middle = 0.5 * (near + far);
      (hulls.world->distance(apart(middle), "object", "other") < 0.0 ? near : far) = middle;
    }
    while (hulls.world->distance(apart(far), "object", "other") > -margin) far -= 0.02 * margin;
    double deepest = infinity;
    for (const Contact& contact : hulls.world->contacts(apart(far))) deepest = std::min(deepest, contact.distance);
    EXPECT_LT(deepest, -0.75 * margin) << i;  // a tenth of both margins is left to faces
  }
}

TEST_P(HullOfSize, DistancesAreTheSameSeenFromEitherAndAtAnyScale) {
  const double size = GetParam();
  Draws draws(3), as_before(3);
  const ConvexHull hull = fingertip(size, draws);
  const TwoHulls hulls(hull, size), of_a_metre(fingertip(1.0, as_before), 1.0);
  const double margin = 0.05 * smallest_half_extent(hull);
  for (int i = 0; i < 100; ++i) {
    const Vector3 way = draws.way();
    const Quaternion first = draws.turn(), second = draws.turn();
    for (double apart = 2.0; apart > 0.0; apart -= 0.01) {
      const State state = hulls.apart({first, second}, apart * size * way);
      const double distance = hulls.world->distance(state, "object", "other");
      if (distance < -margin) break;  // the cores come too near
      const State large = of_a_metre.apart({first, second}, apart * way);
      EXPECT_NEAR(hulls.world->distance(state, "other", "object"), distance, 1e-6 * size) << i << ", " << apart;
      EXPECT_NEAR(of_a_metre.world->distance(large, "object", "other") * size, distance, 0.01 * margin)
          << i << ", " << apart;
    }
  }
}

TEST_P(HullOfSize, ACompoundIsAsFarAsItsNearestPart) {
  const double size = GetParam();
  Draws draws(4);
  const ConvexHull hull = fingertip(size, draws);
  const TwoHulls hulls(hull, size);
  const double margin = 0.05 * smallest_half_extent(hull);
  Scene scene(Vector3::Zero());
  const Compound with_a_tail{{{hull, {}}, {hull, {Vector3(0.0, 0.0, -4.0 * size), Quaternion::Identity()}}}};
  scene.add_body(body("object", hull, 1.0, Vector3::Zero(), Role::object));
  scene.add_body(body("other", with_a_tail, 1.0, Vector3(3.0 * size, 0.0, 0.0)));
  World world(scene);
  for (int i = 0; i < 50; ++i) {
    BodyState first, other;
    first.orientation = draws.turn();
    for (double apart = 2.0; apart > 0.0; apart -= 0.02) {
      other.position = Vector3(0.0, 0.0, apart * size);  // the tail is behind the object then, and the hull before it
      const double expected = std::min(
          hulls.world->distance(hulls.apart({first.orientation, other.orientation}, other.position), "object", "other"),
          hulls.world->distance(
              hulls.apart({first.orientation, other.orientation}, other.position - Vector3(0.0, 0.0, 4.0 * size)),
              "object", "other"));
      if (expected < -margin) break;
      const State state = pack(scene, {{"object", first}, {"other", other}});
      EXPECT_NEAR(world.distance(state, "object", "other"), expected, 0.01 * margin) << i << ", " << apart;
      EXPECT_NEAR(world.distance(state, "other", "object"), expected, 0.01 * margin) << i << ", " << apart;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Hull, HullOfSize, ::testing::Values(0.01, 0.06, 1.0),
                         [](const auto& of) { return std::to_string(std::lround(1000.0 * of.param)) + "mm"; });

// Flat as a leaf, with points that are nearly the same: of some of them no margin can be taken off.
TEST(Hull, OfASliverHasPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  for (int i = 0; i < 300; ++i) {
    ConvexHull sliver;
    const double thin = std::pow(10.0, -2.0 - 2.5 * (even(random) + 1.0));
    for (int k = 0; k < 4 + i % 9; ++k) {
      sliver.points.emplace_back(0.05 * even(random), 0.05 * thin * even(random), 0.05 * even(random));
    }
    Stepping stepping;
    if (i % 2 == 0) stepping.margin = 0.01;
    Scene scene(Vector3(0.0, 0.0, -g), stepping);
    scene.add_body(fixed("table", Plane{}));
    Body leaf = body("object", Sphere{0.05}, 0.01, Vector3(0.0, 0.0, 0.06), Role::object);
    leaf.shape = sliver;
    try {
      scene.add_body(leaf);
    } catch (const std::invalid_argument&) {  // too flat to have a mass
      continue;
    }
    World world(scene);
    EXPECT_TRUE(world.rollout(pack(scene), {Wrench{}}, 0.1).state.allFinite());
  }
}

// Where a prism may touch its table, in its own frame.
std::vector<Vector3> stand(const Scene& scene, World& world, double yaw) {
  const BodyState state = at(Vector3(0.3, -0.2, 0.015), yaw);
  std::vector<Vector3> corners;
  for (const Contact& contact : world.contacts(pack(scene, {{"object", state}}))) {
    corners.push_back(state.orientation.conjugate() * (contact.position - state.position));
  }
  return corners;
}

bool has(const std::vector<Vector3>& points, const Vector3& point, double reach) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vector3& other) { return (other - point).norm() < reach; });
}

TEST(Hull, StandsOnAllItsCornersHoweverItIsTurned) {
  for (const int corners : {5, 6, 7, 12}) {
    Scene scene(Vector3(0.0, 0.0, -g));
    scene.add_body(fixed("table", Plane{}));
    scene.add_body(body("object", prism(corners, 0.05, 0.03), 0.05, Vector3(0.0, 0.0, 0.015), Role::object));
    World world(scene);
    const std::vector<Vector3> first = stand(scene, world, 0.0);
    for (const Vector3& corner : prism(corners, 0.05, 0.03).points) {
      EXPECT_EQ(has(first, corner, 2e-3), corner.z() < 0.0) << corners << " corners";  // the margin rounds them
    }
    for (double yaw = -3.0; yaw < 3.0; yaw += 0.37) {
      const std::vector<Vector3> again = stand(scene, world, yaw);
      ASSERT_EQ(again.size(), first.size()) << corners << " corners, yaw " << yaw;
      for (const Vector3& corner : first) EXPECT_TRUE(has(again, corner, 1e-5)) << corners << ", yaw " << yaw;
    }
  }
}

TEST(Hull, StandsAlsoOnTheCornerThatIsLowest) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", prism(12, 0.05, 0.03), 0.05, Vector3(0.0, 0.0, 0.015), Role::object));
  World world(scene);
  for (double direction = 0.0; direction < 6.2; direction += 0.2) {
    const Vector3 axis(std::cos(direction), std::sin(direction), 0.0);
    BodyState tilted;
    tilted.orientation = turn(0.02, axis);
    double lowest = 0.0;
    for (const Vector3& point : prism(12, 0.05, 0.03).points)
      lowest = std::min(lowest, (tilted.orientation * point).z());
    tilted.position.z() = -lowest - 1e-5;
    double deepest = infinity;
    for (const Contact& contact : world.contacts(pack(scene, {{"object", tilted}}))) {
      deepest = std::min(deepest, contact.distance);
    }
    EXPECT_NEAR(deepest, -1e-5, 7e-5) << direction;
  }
}

TEST(Hull, ObtuseTriangleStandsOnAllThreeCorners) {
  ConvexHull flat;
  for (const double z : {-0.015, 0.015}) {
    for (const auto& [x, y] : {std::pair{-0.08, -0.01}, {0.08, -0.01}, {0.0, 0.02}}) flat.points.emplace_back(x, y, z);
  }
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", flat, 0.05, Vector3(0.0, 0.0, 0.015), Role::object));
  World world(scene);
  for (double yaw = -3.0; yaw < 3.0; yaw += 0.2) {
    double load = 0.0;
    const std::vector<Contact> contacts = world.contacts(pack(scene, {{"object", at(Vector3(0.0, 0.0, 0.015), yaw)}}));
    for (const Contact& contact : contacts) load += contact.normal_force;
    EXPECT_EQ(contacts.size(), 3u) << yaw;
    EXPECT_NEAR(load, 0.05 * g, 0.005 * g) << yaw;
  }
}

TEST(Hull, LiesStillOnAPlane) {
  for (const int corners : {3, 5, 7, 12}) {
    Scene scene(Vector3(0.0, 0.0, -g));
    scene.add_body(fixed("table", Plane{}));
    scene.add_body(body("object", prism(corners, 0.05, 0.03), 0.05, Vector3(0.0, 0.0, 0.015), Role::object));
    World world(scene);
    const State start = pack(scene, {{"object", at(Vector3(0.0, 0.0, 0.015), 0.3)}});
    const State end = world.rollout(start, {Wrench{}}, 1.0).state;
    const BodyState object = body_in(scene, end, "object");
    EXPECT_LT(object.angular_velocity.norm(), 1e-5) << corners << " corners";
    EXPECT_LT((object.position - Vector3(0.0, 0.0, 0.015)).norm(), 2e-5) << corners << " corners";
  }
}

// Its corners are rounded by the collision margin, which is up to a millimetre here.
TEST(Hull, IsAsFarFromAPlaneAsItsLowestCorner) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", brick({0.1, 0.1, 0.1}), 1.0, Vector3(0.0, 0.0, 0.2), Role::object));
  World world(scene);
  for (const double angle : {0.0, 0.1, 0.3, 0.6}) {
    BodyState tilted;
    tilted.position = Vector3(0.0, 0.0, 0.2);
    tilted.orientation = turn(angle, Vector3::UnitX());
    const double expected = 0.2 - 0.05 * (std::cos(angle) + std::sin(angle));
    EXPECT_NEAR(world.distance(pack(scene, {{"object", tilted}}), "object", "table"), expected, 1e-3) << angle;
  }
}

class RoundOnHull : public ::testing::TestWithParam<Solid> {};

TEST_P(RoundOnHull, DoesNotRollAwayFromALevelFace) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("table", prism(6, 0.2, 0.1)));
  const Shape round = std::visit([](const auto& solid) -> Shape { return solid; }, GetParam());
  scene.add_body(body("object", round, 0.1, Vector3(0.0, 0.0, 0.08), Role::object));
  World world(scene);
  BodyState lying;
  lying.position = Vector3(0.01, 0.02, 0.08);
  lying.orientation = turn(0.5 * pi, Vector3::UnitX());
  const State end = world.rollout(pack(scene, {{"object", lying}}), {Wrench{}}, 1.0).state;
  EXPECT_LT((body_in(scene, end, "object").position - lying.position).norm(), 0.003);
}

std::string round_name(const ::testing::TestParamInfo<Solid>& of) {
  const char* names[] = {"sphere", "cylinder", "capsule"};
  return names[of.index];
}

INSTANTIATE_TEST_SUITE_P(Hull, RoundOnHull,
                         ::testing::Values(Solid(Sphere{0.03}), Solid(Cylinder{0.03, 0.1}), Solid(Capsule{0.03, 0.1})),
                         round_name);

TEST(Hulls, ThatAreEqualAreOneInAllScenes) {
  const auto scene_of = [](double height) {
    Scene scene;
    scene.add_body(body("object", prism(8, 0.05, height), 1.0, Vector3::Zero(), Role::object));
    return scene;
  };
  const auto hull_of = [](const Scene& scene) { return scene.collision_shape(0).pieces.front().shape; };
  const Scene scene = scene_of(0.1), same = scene_of(0.1), longer = scene_of(0.11);
  Stepping rounder;
  rounder.margin = 1e-3;
  EXPECT_EQ(hull_of(scene), hull_of(same));
  EXPECT_NE(hull_of(scene), hull_of(longer));
  EXPECT_NE(hull_of(scene), hull_of(scene.with_stepping(rounder)));
}

}  // namespace
}  // namespace energymargin

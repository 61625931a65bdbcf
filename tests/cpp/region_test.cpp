// Regions: what is inside, what is outside, and how they combine.

#include "energymargin/region.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "energymargin/membership.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double hair = 1e-9;

Scene two_bodies() {
  Scene scene;
  Body post = fixed("post", Box{}, {1.0, 2.0, 3.0});
  post.state.orientation = turn(0.5 * pi, Vector3::UnitZ());
  scene.add_body(post);
  scene.add_body(body("object", Box{}, 1.0, Vector3::Zero(), Role::object));
  scene.add_body(body("carrier", Box{}, 1.0, Vector3::Zero()));
  return scene;
}

bool contains(const Region& region, const BodyState& object, const BodyState& carrier = {}) {
  const Scene scene = two_bodies();
  return Membership(region, scene)(pack(scene, {{"object", object}, {"carrier", carrier}}));
}

bool contains(const Region& region, const Vector3& position) {
  BodyState object;
  object.position = position;
  return contains(region, object);
}

BodyState turned(const Quaternion& orientation) {
  BodyState object;
  object.orientation = orientation;
  return object;
}

// A point of the plane at an angle on a circle about (1, 0).
Vector3 on_circle(double angle, double radius = 2.0) {
  return {1.0 + radius * std::cos(angle), radius * std::sin(angle), 7.0};
}

TEST(Region, BallHoldsItsBorderAndNothingBeyond) {
  const Region ball = regions::Ball{"object", {1.0, 0.0, 0.0}, 0.5};
  EXPECT_TRUE(contains(ball, {1.0, 0.0, 0.0}));
  EXPECT_TRUE(contains(ball, {1.5, 0.0, 0.0}));
  EXPECT_TRUE(contains(ball, {1.0, 0.0, -0.5}));
  EXPECT_FALSE(contains(ball, {1.5 + hair, 0.0, 0.0}));
  EXPECT_FALSE(contains(ball, {1.0, 0.4, 0.4}));
}

TEST(Region, BoxHoldsItsBorderAndMayBeEndless) {
  const Region box = regions::Box{"object", {0.0, 0.0, 1.0}, {2.0, 1.0, infinity}};
  EXPECT_TRUE(contains(box, {1.0, -0.5, 1e6}));
  EXPECT_TRUE(contains(box, {-1.0, 0.5, -1e6}));
  EXPECT_FALSE(contains(box, {1.0 + hair, 0.0, 0.0}));
  EXPECT_FALSE(contains(box, {0.0, -0.5 - hair, 0.0}));
}

TEST(Region, DiscDoesNotLookAtTheHeight) {
  const Region disc = regions::Disc{"object", {1.0, 0.0}, 0.5};
  EXPECT_TRUE(contains(disc, {1.5, 0.0, 100.0}));
  EXPECT_TRUE(contains(disc, {1.0, -0.5, -100.0}));
  EXPECT_FALSE(contains(disc, {1.5 + hair, 0.0, 0.0}));
}

TEST(Region, AnnularSectorHoldsWhatItsArcSweepsCounterClockwise) {
  const Region sector = regions::AnnularSector{"object", {1.0, 0.0}, 2.0, 0.5, 0.0, 0.5 * pi};
  EXPECT_TRUE(contains(sector, on_circle(0.0)));
  EXPECT_TRUE(contains(sector, on_circle(0.25 * pi)));
  EXPECT_TRUE(contains(sector, on_circle(0.5 * pi - hair)));
  EXPECT_TRUE(contains(sector, on_circle(0.0, 2.5)));
  EXPECT_TRUE(contains(sector, on_circle(0.0, 1.5)));
  EXPECT_FALSE(contains(sector, on_circle(-hair)));
  EXPECT_FALSE(contains(sector, on_circle(0.5 * pi + hair)));
  EXPECT_FALSE(contains(sector, on_circle(pi)));
  EXPECT_FALSE(contains(sector, on_circle(0.25 * pi, 2.5 + hair)));
  EXPECT_FALSE(contains(sector, on_circle(0.25 * pi, 1.5 - hair)));
  EXPECT_FALSE(contains(sector, {1.0, 0.0, 0.0}));
}

TEST(Region, AnnularSectorOfANegativeSweepTurnsClockwise) {
  const Region sector = regions::AnnularSector{"object", {1.0, 0.0}, 2.0, 0.5, 0.0, -0.5 * pi};
  EXPECT_TRUE(contains(sector, on_circle(0.0)));
  EXPECT_TRUE(contains(sector, on_circle(-0.25 * pi)));
  EXPECT_FALSE(contains(sector, on_circle(0.25 * pi)));
  EXPECT_FALSE(contains(sector, on_circle(-0.5 * pi - hair)));
}

TEST(Region, AnnularSectorReachesAcrossPlusMinusPi) {
  for (const double turns : {0.0, 6.0 * pi, -4.0 * pi}) {
    const Region forward = regions::AnnularSector{"object", {1.0, 0.0}, 2.0, 0.5, 3.0 + turns, 0.5};
    const Region backward = regions::AnnularSector{"object", {1.0, 0.0}, 2.0, 0.5, 3.5 + turns, -0.5};
    for (const Region& sector : {forward, backward}) {
      for (const double angle : {3.0 + 1e-6, pi, 3.3 - 2.0 * pi, 3.5 - 2.0 * pi - 1e-6}) {
        EXPECT_TRUE(contains(sector, on_circle(angle))) << angle;
      }
      for (const double angle : {3.0 - 1e-6, 3.5 - 2.0 * pi + 1e-6, 0.0, 0.25}) {
        EXPECT_FALSE(contains(sector, on_circle(angle))) << angle;
      }
    }
  }
}

TEST(Region, AnnularSectorOfAFullTurnIsTheWholeRing) {
  for (const double sweep : {2.0 * pi, -2.0 * pi}) {
    const Region ring = regions::AnnularSector{"object", {1.0, 0.0}, 2.0, 0.5, 0.3, sweep};
    for (int i = 0; i < 100; ++i) EXPECT_TRUE(contains(ring, on_circle(0.3 + 0.02 * pi * i)));
  }
}

// Inside what a carrier that moves in the plane is about to sweep.
bool swept_by(const Vector2& velocity, double yaw_rate, const Vector2& object, const regions::Swept& swept) {
  BodyState carrier;
  carrier.position = {1.0, 2.0, 0.0};
  carrier.velocity.head<2>() = velocity;
  carrier.angular_velocity.z() = yaw_rate;
  BodyState at;
  at.position = {object.x(), object.y(), 5.0};
  return contains(swept, at, carrier);
}

TEST(Region, SweptOnAStraightPathIsTheStripBehindAndAhead) {
  const regions::Swept swept{"object", "carrier", 0.2, 0.1, 2.0, 0.05, 0.3};
  const Vector2 along(0.5, 0.0);  // sweeps from x = 0.9 to x = 2.0
  EXPECT_TRUE(swept_by(along, 0.0, {1.0, 2.0}, swept));
  EXPECT_TRUE(swept_by(along, 0.0, {1.999, 2.199}, swept));
  EXPECT_TRUE(swept_by(along, 0.0, {0.901, 1.801}, swept));
  EXPECT_FALSE(swept_by(along, 0.0, {2.001, 2.0}, swept));
  EXPECT_FALSE(swept_by(along, 0.0, {0.899, 2.0}, swept));
  EXPECT_FALSE(swept_by(along, 0.0, {1.5, 2.201}, swept));
  EXPECT_FALSE(swept_by(along, 0.0, {1.5, 1.799}, swept));
}

TEST(Region, SweptReachesBeyondItsTime) {
  regions::Swept swept{"object", "carrier", 0.2, 0.1, 2.0, 0.05, 0.3};
  swept.beyond = 0.25;
  EXPECT_TRUE(swept_by({0.5, 0.0}, 0.0, {2.249, 2.0}, swept));  // 2.0 without it
  EXPECT_FALSE(swept_by({0.5, 0.0}, 0.0, {2.251, 2.0}, swept));
  EXPECT_FALSE(swept_by({0.5, 0.0}, 0.0, {0.899, 2.0}, swept));
  // On a circle of radius 1 about (1, 3), the angle of 0.25 m of its path.
  const auto inside = [&](double angle) {
    return swept_by({1.0, 0.0}, 1.0, {1.0 + std::sin(angle), 3.0 - std::cos(angle)}, swept);
  };
  EXPECT_TRUE(inside(2.0 + 0.249));
  EXPECT_FALSE(inside(2.0 + 0.251));
}

TEST(Region, SweptOnATurnIsTheSectorAboutTheCentreOfRotation) {
  const regions::Swept swept{"object", "carrier", 0.2, 0.0, 0.5 * pi, 0.05, 0.3};
  for (const double side : {1.0, -1.0}) {
    // A quarter of a turn of radius 1 about (1, 3), or about (1, 1), that starts at (1, 2).
    const auto inside = [&](double angle, double radius) {
      const Vector2 object(1.0 + radius * std::sin(angle), 2.0 + side * (1.0 - radius * std::cos(angle)));
      return swept_by({1.0, 0.0}, side, object, swept);
    };
    EXPECT_TRUE(inside(1e-6, 1.0));
    EXPECT_TRUE(inside(0.5 * pi - 1e-6, 1.199));
    EXPECT_TRUE(inside(0.8, 0.801));
    EXPECT_FALSE(inside(-1e-6, 1.0));
    EXPECT_FALSE(inside(0.5 * pi + 1e-6, 1.0));
    EXPECT_FALSE(inside(0.8, 0.799));
    EXPECT_FALSE(inside(0.8, 1.201));
  }
}

TEST(Region, SweptByABodyThatIsTooSlowIsADiscAboutIt) {
  const regions::Swept swept{"object", "carrier", 0.2, 0.0, 1.0, 0.05, 0.3};
  for (const Vector2& velocity : {Vector2(0.0, 0.0), Vector2(0.049, 0.0)}) {
    EXPECT_TRUE(swept_by(velocity, 0.0, {1.0, 1.701}, swept));
    EXPECT_FALSE(swept_by(velocity, 0.0, {1.0, 2.301}, swept));
  }
  EXPECT_FALSE(swept_by({0.051, 0.0}, 0.0, {1.0, 1.701}, swept));
}

TEST(Region, SweptFromAGivenMotionStaysWhereItIs) {
  regions::Swept swept{"object", "carrier", 0.2, 0.0, 1.0, 0.05, 0.3};
  swept.at = regions::PlanarMotion{{-5.0, 0.0}, {0.0, 1.0}, 0.0};
  EXPECT_TRUE(swept_by({1.0, 0.0}, 0.0, {-5.0, 0.999}, swept));
  EXPECT_FALSE(swept_by({1.0, 0.0}, 0.0, {1.5, 2.0}, swept));
}

TEST(Region, HalfSpaceHoldsItsBorder) {
  const Region below = regions::HalfSpace{"object", {0.0, 0.6, 0.8}, 1.0};
  EXPECT_TRUE(contains(below, {50.0, 0.0, 1.25}));
  EXPECT_TRUE(contains(below, {0.0, -9.0, 0.0}));
  EXPECT_FALSE(contains(below, {0.0, 0.0, 1.25 + hair}));
}

TEST(Region, HalfSpaceReachesAheadOfAFrameThatMovesAlongItsNormal) {
  const Region near = regions::HalfSpace{"object", Vector3::UnitX(), 0.2, "carrier", 2.0};
  const auto holds = [&](double x, const Vector3& velocity) {
    BodyState object, carrier = turned(turn(0.5 * pi, Vector3::UnitZ()));  // its x axis is the world's y axis
    object.position = {0.0, x, 0.0};
    carrier.velocity = velocity;
    return contains(near, object, carrier);
  };
  EXPECT_TRUE(holds(0.2 - hair, Vector3::Zero()));
  EXPECT_FALSE(holds(0.2 + hair, Vector3::Zero()));
  EXPECT_TRUE(holds(0.8 - hair, {5.0, 0.3, 5.0}));
  EXPECT_FALSE(holds(0.8 + hair, {5.0, 0.3, 5.0}));
  EXPECT_TRUE(holds(0.2 - hair, {0.0, -9.0, 0.0}));
}

TEST(Region, SpeedIsThatOfABodysPoint) {
  BodyState object = turned(turn(0.7, Vector3::UnitZ()));
  object.velocity = {3.0, 4.0, 0.0};
  EXPECT_TRUE(contains(regions::Speed{"object", 5.0}, object));
  EXPECT_FALSE(contains(regions::Speed{"object", 5.0 - hair}, object));
  BodyState spinning = turned(turn(0.5 * pi, Vector3::UnitY()));
  spinning.angular_velocity = {2.0, 0.0, 0.0};
  // The body's z axis lies on the axis of the spin, its x axis across it.
  EXPECT_TRUE(contains(regions::Speed{"object", hair, {0.0, 0.0, 0.5}}, spinning));
  EXPECT_TRUE(contains(regions::Speed{"object", 1.0 + hair, {0.5, 0.0, 0.0}}, spinning));
  EXPECT_FALSE(contains(regions::Speed{"object", 1.0 - hair, {0.5, 0.0, 0.0}}, spinning));
}

TEST(Region, SpeedIsThatOfAPointAlongTheWorldsAxesToo) {
  BodyState spinning = turned(turn(0.5 * pi, Vector3::UnitY()));
  spinning.angular_velocity = {2.0, 0.0, 0.0};
  const auto along_world = [](double limit, const Vector3& point) {
    return regions::Speed{"object", limit, point, "", true};
  };
  EXPECT_TRUE(contains(along_world(hair, {0.5, 0.0, 0.0}), spinning));
  EXPECT_TRUE(contains(along_world(1.0 + hair, {0.0, 0.0, 0.5}), spinning));
  EXPECT_FALSE(contains(along_world(1.0 - hair, {0.0, 0.0, 0.5}), spinning));
}

TEST(Region, SpeedAlongADirectionIsThatOfTheOneComponent) {
  BodyState object;
  object.velocity = {3.0, 0.0, -0.4};
  regions::Speed falling{"object", 0.4 + hair};
  falling.along = -Vector3::UnitZ();
  EXPECT_TRUE(contains(falling, object));
  object.velocity.z() = -0.4 - 2.0 * hair;
  EXPECT_FALSE(contains(falling, object));
  object.velocity.z() = 7.0;  // upwards
  EXPECT_TRUE(contains(falling, object));
}

TEST(Region, SpeedInAFrameIsZeroForABodyThatIsCarriedAlong) {
  BodyState carrier;
  carrier.position = {1.0, 0.0, 0.0};
  carrier.velocity = {0.0, 0.0, 0.7};
  carrier.angular_velocity = {0.0, 0.0, 2.0};
  BodyState object = carrier;
  object.position = {1.0, 0.5, 0.0};
  object.velocity = {-1.0, 0.0, 0.7};
  EXPECT_TRUE(contains(regions::Speed{"object", hair, {0.3, 0.2, 0.1}, "carrier"}, object, carrier));
  EXPECT_FALSE(contains(regions::Speed{"object", 1.0, {0.3, 0.2, 0.1}}, object, carrier));
}

TEST(Region, TiltIsTheAngleOfAnAxis) {
  const BodyState tilted = turned(turn(0.3, Vector3::UnitX()) * turn(1.0, Vector3::UnitZ()));
  const auto tilt = [](double limit, const Vector3& reference = Vector3::UnitZ()) {
    return regions::Tilt{"object", Vector3::UnitZ(), reference, limit};
  };
  EXPECT_TRUE(contains(tilt(0.3 + hair), tilted));
  EXPECT_FALSE(contains(tilt(0.3 - hair), tilted));
  EXPECT_TRUE(contains(tilt(pi), tilted));
  EXPECT_FALSE(contains(tilt(pi - 0.3 - hair, -Vector3::UnitZ()), tilted));
  EXPECT_TRUE(contains(tilt(0.0), BodyState{}));
}

TEST(Region, TiltInAFrameIsZeroForABodyThatTurnsAlong) {
  const BodyState both = turned(turn(0.8, Vector3(1.0, 1.0, 0.0).normalized()));
  regions::Tilt tilt{"object", Vector3::UnitX(), Vector3::UnitX(), 1e-7, "carrier"};
  EXPECT_TRUE(contains(tilt, both, both));
  tilt.frame = "";
  EXPECT_FALSE(contains(tilt, both, both));
}

TEST(Region, FrameOfAFixedBodyIsWhereTheSceneSays) {
  // In the post's frame, (1, 0, 0) is one metre along the world's y axis from it.
  const Region ball = regions::Ball{"object", {1.0, 0.0, 0.0}, hair, "post"};
  EXPECT_TRUE(contains(ball, {1.0, 3.0, 3.0}));
  EXPECT_FALSE(contains(ball, {2.0, 2.0, 3.0}));
}

// Regions about the position of a point, in a frame.
std::vector<Region> positional(const std::string& frame, regions::Point point = regions::Point::origin) {
  return {regions::Ball{"object", {0.2, 0.1, 0.0}, 0.8, frame, point},
          regions::Box{"object", {0.1, 0.0, 0.1}, {1.0, 1.5, 2.0}, frame, point},
          regions::Disc{"object", {0.0, 0.3}, 0.7, frame, point},
          regions::AnnularSector{"object", {0.1, 0.0}, 0.7, 0.4, 2.5, 2.0, frame, point},
          regions::HalfSpace{"object", {0.0, 0.6, 0.8}, 0.1, frame, 0.0, point}};
}

// States with object and carrier anywhere within a metre or so.
States random_states(const Scene& scene, int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto vector = [&] { return Vector3(even(random), even(random), even(random)); };
  const auto anything = [&] {
    const Quaternion orientation(even(random), even(random), even(random), even(random));
    return BodyState{vector(), orientation.normalized(), vector(), vector()};
  };
  States states(count, StateLayout(scene).dimension());
  for (int i = 0; i < count; ++i) {
    const BodyState object = anything();
    states.row(i) = pack(scene, {{"object", object}, {"carrier", anything()}}).transpose();
  }
  return states;
}

TEST(Region, RegionInABodysFrameIsTheWorldsRegionMovedWithTheBody) {
  const Scene scene = two_bodies();
  const States states = random_states(scene, 200);
  const std::vector<Region> moved = positional("carrier");
  const std::vector<Region> still = positional("");
  for (std::size_t r = 0; r < moved.size(); ++r) {
    const Mask mask = Membership(moved[r], scene)(states);
    EXPECT_TRUE(mask.any() && !mask.all()) << "region " << r << " tells nothing apart";
    for (int i = 0; i < states.rows(); ++i) {
      const auto bodies = unpack(scene, states.row(i)).bodies;
      const BodyState& carrier = bodies.at("carrier");
      const Vector3 seen = carrier.orientation.conjugate() * (bodies.at("object").position - carrier.position);
      EXPECT_EQ(mask(i), contains(still[r], seen)) << "region " << r << ", state " << i;
    }
  }
}

// An object whose frame is 0.5 m away from its centre of mass, and one whose frame is there.
Scene off_center(const Vector3& center) {
  Scene scene;
  scene.add_body(fixed("post", Box{}, {1.0, 2.0, 3.0}));
  Body object = body("object", Box{}, 1.0, Vector3::Zero(), Role::object);
  object.inertial = Inertial{center, Vector3::Ones(), turn(0.4, Vector3::UnitX())};
  scene.add_body(object);
  scene.add_body(body("carrier", Box{}, 1.0, Vector3::Zero()));
  return scene;
}

TEST(Region, RegionAboutTheCentreOfMassIsThatAboutAFrameThatIsThere) {
  const Vector3 center(0.3, -0.4, 0.0);
  const Scene scene = off_center(center);
  const States states = random_states(scene, 200);
  for (const char* frame : {"", "carrier"}) {
    std::vector<Region> about_center = positional(frame, regions::Point::center_of_mass);
    std::vector<Region> about_origin = positional(frame);
    regions::Swept swept{"object", "carrier"};
    about_origin.push_back(swept);
    swept.point = regions::Point::center_of_mass;
    about_center.push_back(swept);
    for (std::size_t r = 0; r < about_center.size(); ++r) {
      const Membership member(about_center[r], scene);
      const Membership other(about_origin[r], scene);
      int differing = 0;
      for (int i = 0; i < states.rows(); ++i) {
        const State state = states.row(i);
        auto bodies = unpack(scene, state).bodies;
        const BodyState carrier = bodies.at("carrier");
        const BodyState moved = state_at_point(center, bodies.at("object"));
        EXPECT_EQ(member(state), other(pack(scene, {{"object", moved}, {"carrier", carrier}}))) << r << ", " << i;
        differing += member(state) != other(state) ? 1 : 0;
      }
      EXPECT_GT(differing, 5) << "region " << r << " tells the points not apart";
    }
  }
}

TEST(Region, CentreOfMassOfAFixedBodyIsAnErrorThatNamesIt) {
  const Scene scene = two_bodies();
  for (const Region& region :
       {Region(regions::Ball{"post", Vector3::Zero(), 1.0, "", regions::Point::center_of_mass}),
        Region(regions::Disc{"post", Vector2::Zero(), 1.0, "", regions::Point::center_of_mass})}) {
    EXPECT_TRUE(rejects([&] { Membership(region, scene); }, {"'center_of_mass' of 'post'", "fixed", "'origin'"}));
  }
}

TEST(Region, ArrayAndSingleStatesAgreeAndDeMorganHolds) {
  const Scene scene = two_bodies();
  const States states = random_states(scene, 300);
  std::vector<Region> all = positional("carrier");
  all.push_back(regions::Swept{"object", "carrier", 0.5, 0.5, 2.0, 0.5, 0.8});
  all.push_back(regions::Speed{"object", 1.0, {0.1, 0.2, 0.3}, "carrier"});
  all.push_back(regions::Tilt{"object", Vector3::UnitX(), Vector3::UnitY(), 1.2, "carrier"});
  const auto mask = [&](const Region& region) { return Membership(region, scene)(states); };
  for (const Region& a : all) {
    const Mask in_a = mask(a);
    EXPECT_TRUE(in_a.any() && !in_a.all());
    const Membership one(a, scene);
    for (int i = 0; i < states.rows(); ++i) EXPECT_EQ(one(State(states.row(i))), in_a(i));
    for (const Region& b : all) {
      const Mask in_b = mask(b);
      EXPECT_TRUE((mask(a & b) == (in_a && in_b)).all());
      EXPECT_TRUE((mask(a | b) == (in_a || in_b)).all());
      EXPECT_TRUE((mask(~(a & b)) == mask(~a | ~b)).all());
      EXPECT_TRUE((mask(~(a | b)) == mask(~a & ~b)).all());
    }
    EXPECT_TRUE((mask(~~a) == in_a).all());
  }
}

TEST(Region, PredicateIsAskedOnceForAllStatesAndCombinesWithTheRest) {
  const Scene scene = two_bodies();
  const States states = random_states(scene, 50);
  int calls = 0;
  const Region right = regions::Predicate{[&calls](const States& given) -> Mask {
    ++calls;
    return given.col(0).array() > 0.0;
  }};
  const Mask mask = Membership(right, scene)(states);
  EXPECT_EQ(calls, 1);
  const Region left = regions::HalfSpace{"object", Vector3::UnitX(), 0.0};
  EXPECT_TRUE((Membership(~right, scene)(states) == !mask).all());
  EXPECT_TRUE((Membership(right | left, scene)(states)).all());
  EXPECT_FALSE((Membership(right & left, scene)(states)).any());
}

TEST(Region, UnknownBodyOrFrameIsAnErrorThatNamesIt) {
  const Scene scene = two_bodies();
  EXPECT_TRUE(rejects([&] { Membership(regions::Disc{"cup"}, scene); }, {"'cup'", "'object'"}));
  EXPECT_TRUE(rejects([&] { Membership(regions::Swept{"object", "hand"}, scene); }, {"'hand'", "'object'"}));
  const Region nested = ~(regions::Disc{"object"} & Region(regions::Ball{"object", Vector3::Zero(), 1.0, "hand"}));
  EXPECT_TRUE(rejects([&] { Membership(nested, scene); }, {"'hand'", "'object'"}));
}

template <typename Primitive>
auto making(Primitive primitive) {
  return [primitive] { Region{primitive}; };
}

TEST(Region, SizesAndDirectionsThatAreNoneAreRejectedByNameAndValue) {
  const Vector3 o = Vector3::Zero();
  EXPECT_TRUE(rejects(making(regions::Ball{"object", o, 0.0}), {"radius is 0", "above 0"}));
  EXPECT_TRUE(
      rejects(making(regions::HalfSpace{"object", Vector3::UnitX(), 0.0, "", 1.0}), {"ahead", "0 without a frame"}));
  EXPECT_TRUE(rejects(making(regions::Ball{"object", {nan, 0.0, 0.0}, 1.0}), {"center", "nan"}));
  EXPECT_TRUE(rejects(making(regions::Box{"object", o, {1.0, -1.0, 1.0}}), {"size", "-1", "above 0"}));
  EXPECT_TRUE(rejects(making(regions::Box{"object", o, {1.0, nan, 1.0}}), {"size", "nan"}));
  EXPECT_TRUE(rejects(making(regions::Disc{"object", {0.0, 0.0}, infinity}), {"radius", "inf", "finite"}));
  EXPECT_TRUE(rejects(making(regions::AnnularSector{"object", {0.0, 0.0}, 1.0, 0.5, 0.0, 0.0}), {"sweep is 0"}));
  EXPECT_TRUE(
      rejects(making(regions::AnnularSector{"object", {0.0, 0.0}, 1.0, 0.5, 0.0, 6.3}), {"sweep is 6.3", "2 pi"}));
  EXPECT_TRUE(rejects(making(regions::AnnularSector{"object", {0.0, 0.0}, 1.0, 0.0, 0.0, 1.0}), {"half_width is 0"}));
  EXPECT_TRUE(rejects(making(regions::HalfSpace{"object", {0.0, 0.0, 2.0}, 0.0}), {"normal", "(0, 0, 2)", "length 1"}));
  EXPECT_TRUE(rejects(making(regions::Speed{"object", -1.0}), {"limit is -1", "at least 0"}));
  EXPECT_TRUE(rejects(making(regions::Tilt{"object", Vector3::UnitZ(), o, 0.1}), {"reference", "length 1"}));
  EXPECT_TRUE(rejects(making(regions::Tilt{"object", Vector3::UnitZ(), Vector3::UnitZ(), 4.0}), {"limit is 4", "pi"}));
  EXPECT_TRUE(rejects(making(regions::Swept{"object", "carrier", 0.0}), {"half_width is 0", "above 0"}));
  EXPECT_TRUE(rejects(making(regions::Swept{"object", "carrier", 0.5, -1.0}), {"behind is -1", "at least 0"}));
  regions::Speed along{"object", 1.0};
  along.along = Vector3(0.0, 0.0, 2.0);
  EXPECT_TRUE(rejects(making(along), {"along", "(0, 0, 2)", "length 1"}));
  regions::Swept beyond{"object", "carrier"};
  beyond.beyond = -1.0;
  EXPECT_TRUE(rejects(making(beyond), {"beyond is -1", "at least 0"}));
  EXPECT_TRUE(rejects(making(regions::Predicate{}), {"predicate", "empty"}));
}

TEST(Region, ComplementOfOtherThanOneAndEmptyCombinationsAreRejected) {
  const Region disc = regions::Disc{"object"};
  EXPECT_TRUE(rejects(making(regions::Complement{{disc, disc}}), {"one"}));
  EXPECT_TRUE(rejects(making(regions::Complement{}), {"one"}));
  EXPECT_TRUE(rejects(making(regions::Intersection{}), {"at least one"}));
  EXPECT_TRUE(rejects(making(regions::Union{}), {"at least one"}));
}

TEST(Region, ComplementOfAComplementIsTheRegionItselfHoweverOften) {
  const Region disc = regions::Disc{"object"};
  Region region = disc;
  for (int i = 0; i < 100'000; ++i) region = ~region;
  EXPECT_EQ(&region.expression(), &disc.expression());
  EXPECT_FALSE(contains(~region, Vector3::Zero()));
}

// As deep as it says, of complements of intersections.
Region nested(int levels) {
  Region region = regions::Disc{"object"};
  for (int i = 0; i < levels; ++i) {
    region = i % 2 == 0 ? Region(regions::Intersection{{region}}) : Region(regions::Complement{{region}});
  }
  return region;
}

TEST(Region, MoreLevelsThanAProblemFileHasAreRejectedAsTheyAreBuilt) {
  const Region deepest = nested(most_region_levels);
  EXPECT_TRUE(contains(deepest, Vector3::Zero()));
  EXPECT_FALSE(contains(deepest, Vector3(2.0, 0.0, 0.0)));
  EXPECT_TRUE(rejects([] { nested(most_region_levels + 1); }, {"region is of 65 levels of & | ~", "at most 64"}));
  const Region disc = regions::Disc{"object"};
  EXPECT_TRUE(rejects([&] { disc & ~(deepest | disc); }, {"65 levels"}));
}

TEST(Region, LongChainIsOneLevelUpToTheMostPrimitives) {
  const Region disc = regions::Disc{"object"};
  Region all = disc;
  Region any = disc;
  for (int i = 1; i < 5000; ++i) {
    all = all & disc;
    any = disc | any;
  }
  EXPECT_EQ(std::get<regions::Intersection>(all.expression()).of.size(), 5000u);
  EXPECT_TRUE(contains(~all | any, Vector3::Zero()));
  EXPECT_FALSE(contains(all & any, Vector3(2.0, 0.0, 0.0)));
  const std::vector<Region> most(most_region_primitives, disc);
  EXPECT_NO_THROW(Region{regions::Union{most}});
  EXPECT_TRUE(rejects([&] { Region{regions::Union{most}} | disc; }, {"made of 10001 primitives", "at most 10000"}));
}

TEST(Region, RegionThatDoublesWithEachStepIsRejectedBeforeItFillsTheMemory) {
  const Region disc = regions::Disc{"object"};
  const auto doubled = [&](const auto& twice) {
    return [&disc, twice] {
      Region region = disc;
      for (int i = 0; i < 60; ++i) region = twice(region);
    };
  };
  EXPECT_TRUE(rejects(doubled([](const Region& region) { return region & region; }), {"16384 primitives"}));
  EXPECT_TRUE(rejects(doubled([](const Region& region) { return Region(regions::Union{{region, ~region}}); }),
                      {"16384 primitives"}));
}

TEST(Region, LinkCountsWhereItsJointsPutItAsBodyAndAsFrame) {
  Scene scene = rod_on_post(Vector3::UnitZ());
  scene.add_body(body("object", Sphere{0.1}, 1.0, {9.0, 0.0, 0.0}, Role::object));
  const auto turned_by = [&](double angle, double velocity, const Vector3& object) {
    BodyState there;
    there.position = object;
    return pack(scene, {{"object", there}}, {{"hinge", {angle, velocity}}});
  };
  const Vector3 far(9.0, 0.0, 0.0);
  const Membership above(regions::Ball{"rod", {0.0, 0.25, 0.0}, 1e-9}, scene);
  EXPECT_TRUE(above(turned_by(0.5 * pi, 0.0, far)));
  EXPECT_FALSE(above(turned_by(0.0, 0.0, far)));
  const Membership beyond_its_end(regions::Ball{"object", {0.75, 0.0, 0.0}, 1e-9, "rod"}, scene);
  EXPECT_TRUE(beyond_its_end(turned_by(0.5 * pi, 0.0, {0.0, 1.0, 0.0})));
  EXPECT_FALSE(beyond_its_end(turned_by(0.0, 0.0, {0.0, 1.0, 0.0})));
  const Membership slow(regions::Speed{"rod", 1.0, {0.25, 0.0, 0.0}}, scene);  // its end, 0.5 m from the hinge
  EXPECT_TRUE(slow(turned_by(0.3, 2.0 - 1e-9, far)));
  EXPECT_FALSE(slow(turned_by(0.3, 2.0 + 1e-9, far)));
}

}  // namespace
}  // namespace energymargin

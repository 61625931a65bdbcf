// Springs between points of bodies.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Spring spring(const std::string& a, const std::string& b, double stiffness, double rest_length = 0.0,
              double damping = 0.0) {
  Spring made;
  made.body_a = a;
  made.body_b = b;
  made.stiffness = stiffness;
  made.rest_length = rest_length;
  made.damping = damping;
  return made;
}

// Two spheres of 1 kg and 3 kg on the x axis, one metre apart.
Scene two_spheres(const Spring& between, const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity, exact());
  scene.add_body(body("light", Sphere{0.1}, 1.0, Vector3::Zero(), Role::object));
  scene.add_body(body("heavy", Sphere{0.1}, 3.0, {1.0, 0.0, 0.0}));
  scene.add_spring(between);
  return scene;
}

double apart(const Scene& scene, const State& state) {
  const Unpacked at = unpack(scene, state);
  return (at.bodies.at("heavy").position - at.bodies.at("light").position).norm();
}

TEST(Spring, TwoBodiesSwingWithThePeriodOfTheirReducedMassAndKeepEnergyAndMomentum) {
  const Scene scene = two_spheres(spring("light", "heavy", 30.0, 0.9));
  World world(scene);
  const double energy = world.energy(pack(scene));
  EXPECT_NEAR(energy, 0.5 * 30.0 * 0.1 * 0.1, 1e-15);
  const std::vector<State> swing = trajectory(scene, pack(scene), 2400);
  std::vector<double> passages;
  for (std::size_t i = 1; i < swing.size(); ++i) {
    const double before = apart(scene, swing[i - 1]) - 0.9;
    const double now = apart(scene, swing[i]) - 0.9;
    if (before > 0.0 && now <= 0.0) passages.push_back((static_cast<double>(i) + now / (before - now)) * step);
    EXPECT_NEAR(world.energy(swing[i]), energy, 0.02 * energy) << i;
    EXPECT_LT(momentum(scene, swing[i]).norm(), 1e-12);
  }
  ASSERT_GT(passages.size(), 5u);
  const double period = (passages.back() - passages.front()) / static_cast<double>(passages.size() - 1);
  EXPECT_NEAR(period / (2.0 * pi * std::sqrt(0.75 / 30.0)), 1.0, 1e-4);
  EXPECT_NEAR(world.energy(swing[2400]), energy, 0.02 * energy);
}

TEST(Spring, DampingTakesTheEnergyOfTheSwingAndLeavesTheMomentum) {
  const Scene scene = two_spheres(spring("light", "heavy", 30.0, 0.9, 6.0));
  BodyState light = scene.body("light").state;
  light.velocity = {0.4, 0.0, 0.0};
  const State end = after(scene, pack(scene, {{"light", light}}), 1200);
  EXPECT_NEAR(apart(scene, end), 0.9, 1e-6);
  EXPECT_NEAR(body_in(scene, end, "light").velocity.x(), 0.1, 1e-6);
  EXPECT_NEAR(World(scene).energy(end), 0.5 * 4.0 * 0.01, 1e-6);
}

TEST(Spring, BodyHangsFromAFixedOneAtWeightOverStiffness) {
  Scene scene({0.0, 0.0, -g}, exact());
  scene.add_body(fixed("ceiling", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 2.0}));
  scene.add_body(body("object", Sphere{0.1}, 1.5, {0.0, 0.0, 1.5}, Role::object));
  scene.add_spring(spring("ceiling", "object", 40.0, 0.3, 8.0));
  const BodyState end = body_in(scene, after(scene, pack(scene), 1920), "object");
  EXPECT_NEAR(end.position.z(), 2.0 - 0.3 - 1.5 * g / 40.0, 1e-9);
  EXPECT_LT(end.velocity.norm(), 1e-9);
}

TEST(Spring, BodyOnADampedSpringSettlesAtForceOverStiffness) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("object", Sphere{0.1}, 1.5, {1.0, 0.0, 0.0}, Role::object));
  scene.add_spring(spring("post", "object", 40.0, 1.0, 8.0));
  const Drive pull = steady("object", {2.0, 0.0, 0.0}, Vector3::Zero(), 1920);
  EXPECT_NEAR(body_in(scene, after(scene, pack(scene), 1920, {0.0, {pull}}), "object").position.x(), 1.05, 1e-9);
}

TEST(Spring, PullAtAPointOffTheCentreTurnsTheBody) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 5.0}));
  Body block = body("object", Box{{0.4, 0.2, 0.1}}, 2.0, Vector3::Zero(), Role::object);
  block.state.orientation = turn(0.5 * pi, Vector3::UnitZ());  // its x axis is the world's y axis
  scene.add_body(block);
  Spring pull = spring("object", "post", 0.004, 1.0);
  pull.point_a = {0.2, 0.0, 0.0};
  pull.point_b = {0.2, 0.0, 0.0};
  scene.add_spring(pull);
  const BodyState end = body_in(scene, after(scene, pack(scene), 1), "object");
  const Vector3 arm(0.0, 0.2, 0.0);
  const Vector3 span = Vector3(0.2, 0.0, 5.0) - arm;
  const Vector3 force = 0.004 * (span.norm() - 1.0) * span.normalized();
  EXPECT_TRUE(end.velocity.isApprox(force / 2.0 * step, 1e-9));
  const Vector3 spin = inertia_of(block, block.state.orientation).inverse() * arm.cross(force) * step;
  EXPECT_TRUE(end.angular_velocity.isApprox(spin, 1e-4));
}

// A block whose centre of mass is off its frame, and a post above it.
Scene lopsided(const Spring& between, double duration = step) {
  Stepping stepping = exact();
  stepping.step = duration;
  Scene scene(Vector3::Zero(), stepping);
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 2.0}));
  const Body block = body("object", Box{{0.4, 0.2, 0.1}}, 2.0, {0.3, 0.1, 0.0}, Role::object);
  Body made = described_from({{0.3, -0.2, 0.15}, turn(0.8, Vector3::UnitX())}, block);
  scene.add_body(made);
  scene.add_spring(between);
  return scene;
}

TEST(Spring, PullAndDampingOnABodyWithItsCentreElsewhereAreThoseAtTheirPoint) {
  Spring pull = spring("object", "post", 3.0, 1.0, 2.0);
  pull.point_a = {-0.1, 0.3, 0.2};
  const Scene scene = lopsided(pull);
  const Body& block = scene.body("object");
  BodyState moving = block.state;
  moving.velocity = {0.2, -0.1, 0.3};
  const BodyState at = state_at_point(pull.point_a, moving);
  const BodyState center = center_of(block, moving);
  const Vector3 span = Vector3(0.0, 0.0, 2.0) - at.position;
  const Vector3 along = span.normalized();
  const Vector3 force = (3.0 * (span.norm() - 1.0) - 2.0 * along.dot(at.velocity)) * along;
  const BodyState end = body_in(scene, after(scene, pack(scene, {{"object", moving}}), 1), "object");
  EXPECT_TRUE((center_of(block, end).velocity - center.velocity).isApprox(force / 2.0 * step, 1e-9));
  const Vector3 spin = inertia_of(block, moving.orientation).inverse() * (at.position - center.position).cross(force);
  EXPECT_TRUE(end.angular_velocity.isApprox(spin * step, 1e-2));  // the spin of this step turns the inertia a little
}

TEST(Spring, SwingOfABodyWithItsCentreElsewhereKeepsItsEnergyTheBetterTheShorterTheStep) {
  Spring pull = spring("object", "post", 20.0, 1.2);
  pull.point_a = {-0.1, 0.3, 0.2};
  const auto drift = [&](double duration) {
    const Scene scene = lopsided(pull, duration);
    const World world(scene);
    const double energy = world.energy(pack(scene));
    double most = 0.0;
    for (const State& state : trajectory(scene, pack(scene), static_cast<int>(std::lround(2.0 / duration)))) {
      most = std::max(most, std::abs(world.energy(state) - energy));
    }
    return most / energy;
  };
  EXPECT_LT(drift(step), 0.1);
  EXPECT_LT(drift(step / 8.0), 0.2 * drift(step));
}

TEST(Spring, LimitOfStiffnessIsThatOfTheBodyWhateverItsFrame) {
  const Body rod = body("object", Box{{1.0, 0.05, 0.05}}, 2.0, Vector3::Zero(), Role::object);
  const Pose frame{{0.4, 0.1, -0.2}, turn(0.7, Vector3::UnitY())};
  const auto most = [](const Body& made, const Vector3& point) {
    Scene scene(Vector3::Zero(), exact());
    scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 3.0}));
    scene.add_body(made);
    double low = 1.0;
    double high = 1e6;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      Scene tried = scene;
      Spring stiff = spring("object", "post", middle);
      stiff.point_a = point;
      bool fits = true;
      try {
        tried.add_spring(stiff);
      } catch (const std::invalid_argument&) {
        fits = false;
      }
      (fits ? low : high) = middle;
    }
    return low;
  };
  for (const Vector3& point : {Vector3(0.5, 0.0, 0.0), Vector3(0.1, 0.3, 0.0)}) {
    const double expected = most(rod, point);
    EXPECT_NEAR(most(described_from(frame, rod), seen_from(frame, {point}).position), expected, 1e-6 * expected);
  }
}

TEST(Spring, SpringOnALinkTurnsItsJointUntilItPointsToTheOtherEnd) {
  Joint damped;
  damped.damping = 0.3;
  Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), damped);
  scene.add_body(fixed("wall", Box{{0.1, 0.1, 0.1}}, {0.0, 3.0, 0.0}));
  Spring pull = spring("rod", "wall", 5.0, 1.0);
  pull.point_a = {0.25, 0.0, 0.0};
  scene.add_spring(pull);
  EXPECT_NEAR(joint_in(scene, after(scene, pack(scene), 1200), "hinge").position, 0.5 * pi, 1e-6);
}

TEST(Spring, PullAndDampingOnALinkAreThoseAtItsPoint) {
  Scene scene = rod_on_post(Vector3::UnitZ());
  scene.add_body(fixed("wall", Box{{0.1, 0.1, 0.1}}, {0.5, 3.0, 0.0}));
  Spring pull = spring("rod", "wall", 5.0, 1.0, 2.0);
  pull.point_a = {0.25, 0.0, 0.0};
  scene.add_spring(pull);
  for (const double speed : {0.0, 0.3}) {
    const State start = pack(scene, {}, {{"hinge", {0.0, speed}}});  // the rod's end moves towards the wall
    const double force = 5.0 * 2.0 - 2.0 * 0.5 * speed;
    EXPECT_NEAR(joint_in(scene, after(scene, start, 1), "hinge").velocity, speed + 0.5 * force * step / rod_inertia,
                1e-9);
  }
}

TEST(Spring, SpringBetweenALinkAndAFreeBodyKeepsTheirMomentum) {
  Scene scene = two_boxes_on_a_hinge();
  Spring pull = spring("arm", "object", 2.0, 1.0, 0.1);
  pull.point_a = {0.05, 0.0, 0.1};
  scene.add_spring(pull);
  const State end = after(scene, pack(scene), 60);
  EXPECT_GT(body_in(scene, end, "object").velocity.norm(), 1.0);
  EXPECT_LT(momentum(scene, end).norm(), 0.01 * body_in(scene, end, "object").velocity.norm());
}

TEST(Spring, SpringOfNoLengthPullsNowhere) {
  Spring tight = spring("light", "heavy", 30.0, 0.5);
  tight.point_a = {1.0, 0.0, 0.0};
  const Scene scene = two_spheres(tight);
  EXPECT_TRUE(after(scene, pack(scene), 60).isApprox(pack(scene), 1e-15));
}

// The energy of a body on a spring after two seconds, as a multiple of that at the start.
double energy_ratio(const Scene& scene) {
  const State end = after(scene, pack(scene), 480);
  return World(scene).energy(end) / World(scene).energy(pack(scene));
}

// The stiffness limit at a point of a rod of 1 m and 2 kg, along the rod from its centre.
double limit_at(double offset) {
  return 1.0 / (0.5 + offset * offset / (2.0 * (1.0 + 0.05 * 0.05) / 12.0)) / (step * step);
}

TEST(Spring, SpringAtItsLimitOfStiffnessAndDampingIsStableAlsoOffTheCentre) {
  for (const double offset : {0.0, 0.25, 0.5, 2.0}) {
    for (const double damping : {0.0, 1.0}) {
      Scene scene(Vector3::Zero(), exact());
      scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 3.0}));
      scene.add_body(body("object", Box{{1.0, 0.05, 0.05}}, 2.0, Vector3::Zero(), Role::object));
      const double limit = 0.9999 * limit_at(offset);
      Spring stiff = spring("object", "post", limit, 2.9, damping * limit * step);
      stiff.point_a.x() = stiff.point_b.x() = offset;
      scene.add_spring(stiff);
      EXPECT_LT(energy_ratio(scene), 2.0) << "offset " << offset << ", damping " << damping;
      stiff.stiffness = 1.001 * limit_at(offset);
      EXPECT_TRUE(rejects([&] { scene.add_spring(stiff); }, {"stiffness", "at most"})) << offset;
    }
  }
}

auto adding(const Spring& made) {
  return [made] { two_spheres(made); };
}

TEST(Spring, SpringTooStiffForTheStepIsRejectedWithTheLimit) {
  const double most = 0.75 / (step * step);  // 43200 N/m
  EXPECT_NO_THROW(adding(spring("light", "heavy", most))());
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", 1.01 * most)),
                      {"spring 'light' - 'heavy'", "stiffness is 43632", "at most 43200 N/m", "shorter step"}));
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", 1.0, 0.0, 1.01 * most * step)),
                      {"damping is 181.8", "at most 180 N s/m"}));
}

TEST(Spring, SpringThatCannotBeIsRejectedByNameArgumentAndValue) {
  EXPECT_TRUE(rejects(adding(spring("light", "cup", 1.0)), {"spring 'light' - 'cup'", "'light', 'heavy'"}));
  EXPECT_TRUE(rejects(adding(spring("light", "light", 1.0)), {"body_b is 'light'", "another body"}));
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", -1.0)), {"stiffness is -1", "at least 0"}));
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", nan)), {"stiffness is nan", "finite"}));
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", 1.0, -0.5)), {"rest_length is -0.5", "at least 0"}));
  EXPECT_TRUE(rejects(adding(spring("light", "heavy", 1.0, 0.0, infinity)), {"damping is inf", "finite"}));
  Spring nowhere = spring("light", "heavy", 1.0);
  nowhere.point_b.y() = nan;
  EXPECT_TRUE(rejects(adding(nowhere), {"point_b", "nan", "finite"}));
  Scene still;
  still.add_body(fixed("floor", Plane{}));
  still.add_body(fixed("post", Box{}));
  EXPECT_TRUE(rejects([&] { still.add_spring(spring("floor", "post", 1.0)); }, {"'post'", "at most one fixed"}));
}

}  // namespace
}  // namespace energymargin

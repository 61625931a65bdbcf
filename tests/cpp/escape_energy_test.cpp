// Escape energy of a quasi-static object. The closed forms are those of bodies that touch exactly; the object may be in
// another body by a tolerance of 2e-4 of its smallest half extent.

#include "energymargin/metrics/escape_energy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "energymargin/membership.hpp"
#include "expect.hpp"
#include "physics/free_space.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// Four walls on the ground around a square of half edge `half`.
Scene pen(double half, double thickness, double height, const Vector3& gravity = Vector3(0.0, 0.0, -g)) {
  Scene scene(gravity);
  scene.add_body(fixed("floor", Plane{}));
  const double away = half + 0.5 * thickness;
  const double length = 2.0 * (half + thickness);
  scene.add_body(fixed("east", Box{{thickness, length, height}}, {away, 0.0, 0.5 * height}));
  scene.add_body(fixed("west", Box{{thickness, length, height}}, {-away, 0.0, 0.5 * height}));
  scene.add_body(fixed("north", Box{{2.0 * half, thickness, height}}, {0.0, away, 0.5 * height}));
  scene.add_body(fixed("south", Box{{2.0 * half, thickness, height}}, {0.0, -away, 0.5 * height}));
  return scene;
}

Problem escape_from(const Scene& scene, const Region& captured) {
  Problem problem = problem_of(scene, Vector3::Zero(), Vector3::Zero(), 0.3, captured);
  problem.force = scene.body("object").linear_factor;
  return problem;
}

Region square(double half) { return regions::Box{"object", Vector3::Zero(), {2.0 * half, 2.0 * half, infinity}}; }

constexpr double rim = 0.1;
constexpr double ball_weight = 0.2 * g;

Problem ball_in_pen(double half = 0.1, double thickness = 0.02, double height = rim) {
  Scene scene = pen(half, thickness, height);
  scene.add_body(body("object", Sphere{0.03}, 0.2, {0.005, -0.005, 0.03}, Role::object));
  return escape_from(scene, square(half + thickness + 0.08));
}

Problem box_in_pen(double half) {
  Scene scene = pen(half, 0.02, rim);
  scene.add_body(body("object", Box{{0.12, 0.12, 0.05}}, 0.5, {0.0, 0.0, 0.025}, Role::object));
  return escape_from(scene, square(half + 0.12));
}

Problem closed_box() {
  Problem problem = ball_in_pen();
  problem.scene.add_body(fixed("lid", Box{{0.3, 0.3, 0.02}}, {0.0, 0.0, rim + 0.01}));
  return problem;
}

// A disc of diameter 0.1 that slides in a plane, in a pen with a gap in its eastern wall.
Problem disc_behind_a_gap(double gap) {
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("west", Box{{0.02, 0.24, 0.1}}, {-0.11, 0.0, 0.0}));
  scene.add_body(fixed("north", Box{{0.2, 0.02, 0.1}}, {0.0, 0.11, 0.0}));
  scene.add_body(fixed("south", Box{{0.2, 0.02, 0.1}}, {0.0, -0.11, 0.0}));
  const double post = 0.5 * (0.24 - gap);
  scene.add_body(fixed("upper", Box{{0.02, post, 0.1}}, {0.11, 0.5 * (gap + post), 0.0}));
  scene.add_body(fixed("lower", Box{{0.02, post, 0.1}}, {0.11, -0.5 * (gap + post), 0.0}));
  Body disc = body("object", Cylinder{0.05, 0.02}, 1.0, {-0.03, 0.02, 0.0}, Role::object);
  disc.linear_factor = {1.0, 1.0, 0.0};
  disc.angular_factor = Vector3::UnitZ();
  scene.add_body(disc);
  return escape_from(scene, regions::Disc{"object", Vector2::Zero(), 0.25});
}

// A part on a rail along x, at rest at a spring's anchor.
Problem part_on_a_spring(double away) {
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("bench", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, -1.0}));
  Body part = body("object", Box{{0.1, 0.1, 0.1}}, 1.0, Vector3::Zero(), Role::object);
  part.linear_factor = Vector3::UnitX();
  part.angular_factor = Vector3::Zero();
  scene.add_body(part);
  scene.add_spring({"bench", "object", {0.0, 0.0, 1.0}, Vector3::Zero(), 200.0, 0.0, 0.0});
  return escape_from(scene, regions::Ball{"object", Vector3::Zero(), away});
}

// A column that falls over when its centre of mass is above an edge of its foot.
Problem column() {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  scene.add_body(body("object", Box{{0.1, 0.1, 0.3}}, 1.0, {0.0, 0.0, 0.15}, Role::object));
  return escape_from(scene, regions::Tilt{"object", Vector3::UnitZ(), Vector3::UnitZ(), 1.2});
}

void expect_history_falls_to_the_energy(const EscapeEnergy& found) {
  ASSERT_FALSE(found.history.empty());
  EXPECT_EQ(found.history.back().second, found.energy);
  for (std::size_t i = 1; i < found.history.size(); ++i) {
    EXPECT_LT(found.history[i].second, found.history[i - 1].second);
    EXPECT_GE(found.history[i].first, found.history[i - 1].first);
  }
}

void expect_path_leads_out_over_its_barrier(const EscapeEnergy& found, const Problem& problem) {
  const World world(problem.scene);
  const Membership captured(problem.captured, problem.scene);
  FreeSpace free_space(problem.scene, problem.state, problem.scene.index("object"));
  const double start = world.energy(State(found.path.row(0)));
  ASSERT_GE(found.barrier, 0);
  EXPECT_NEAR(world.energy(State(found.path.row(found.barrier))) - start, found.energy, 1e-12);
  const int offset = StateLayout(problem.scene).offset(problem.scene.index("object"));
  for (Eigen::Index i = 0; i < found.path.rows(); ++i) {
    const State state = found.path.row(i);
    EXPECT_LE(world.energy(state) - start, found.energy + 1e-12) << "row " << i;
    EXPECT_EQ(captured(state), i + 1 < found.path.rows()) << "row " << i;
    const BodyState object = StateLayout::read(state.data() + offset);
    EXPECT_GE(free_space.clearance({object.position, object.orientation}, 0.0), -1e-6) << "row " << i;
    EXPECT_TRUE(object.velocity.isZero(0.0) && object.angular_velocity.isZero(0.0)) << "row " << i;
  }
}

class Fixture : public testing::TestWithParam<std::string> {
 protected:
  static EscapeEnergy escape(const Problem& problem, int samples, std::uint64_t seed = 0) {
    EscapeEnergyOptions options;
    options.planner = GetParam();
    options.samples = samples;
    options.seed = seed;
    return escape_energy(problem, options);
  }
};

INSTANTIATE_TEST_SUITE_P(Planner, Fixture, testing::Values("bit*", "rrt*"),
                         [](const auto& planner) { return planner.param.substr(0, 3); });

TEST_P(Fixture, BallGetsOutOfAPenOverItsRim) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Problem problem = ball_in_pen();
    const EscapeEnergy found = escape(problem, 1000, seed);
    EXPECT_NEAR(found.energy, ball_weight * rim, 0.01 * ball_weight * rim) << "seed " << seed;
    expect_history_falls_to_the_energy(found);
    expect_path_leads_out_over_its_barrier(found, problem);
  }
}

TEST_P(Fixture, WallAsThinAsPaperIsNotPassedThrough) {
  EXPECT_NEAR(escape(ball_in_pen(0.1, 1e-4), 1000).energy, ball_weight * rim, 0.01 * ball_weight * rim);
}

TEST_P(Fixture, BallGetsOutOfADeepWell) {
  EXPECT_NEAR(escape(ball_in_pen(0.04, 0.02, 0.4), 2000).energy, ball_weight * 0.4, 0.05 * ball_weight * 0.4);
}

TEST_P(Fixture, BoxGetsOutOfAPenByTheHeightOfItsRim) {
  const double energy = 0.5 * g * rim;
  for (const double half : {0.1, 0.064}) {
    const Problem problem = box_in_pen(half);
    const EscapeEnergy found = escape(problem, 2000);
    EXPECT_GT(found.energy, 0.99 * energy);
    EXPECT_LT(found.energy, 1.05 * energy);
    expect_path_leads_out_over_its_barrier(found, problem);
  }
}

TEST_P(Fixture, ColumnFallsOverAnEdgeOfItsFoot) {
  const double energy = g * (std::hypot(0.05, 0.15) - 0.15);
  const EscapeEnergy found = escape(column(), 2000);
  EXPECT_GT(found.energy, 0.99 * energy);
  EXPECT_LT(found.energy, 1.1 * energy);
}

TEST_P(Fixture, CaptureSetThatEndsInMidAirIsLeftWhereItEnds) {
  EXPECT_NEAR(escape(lift(0.2), 300).energy, g * 0.2, 1e-6);
}

TEST_P(Fixture, SpringIsPulledOutAtHalfItsStiffnessTimesTheSquareOfTheWay) {
  EXPECT_NEAR(escape(part_on_a_spring(0.06), 300).energy, 0.5 * 200.0 * 0.06 * 0.06, 1e-6);
}

// A spring that is longer than the way across to its anchor pushes to either side: a switch.
TEST_P(Fixture, SwitchIsPushedOverWhereItsSpringIsShortest) {
  const double across = 0.3, rest = 0.5, stiffness = 200.0;
  const double side = std::sqrt(rest * rest - across * across);
  Scene scene(Vector3::Zero());
  scene.add_body(fixed("bench", Box{{0.1, 0.1, 0.1}}, {0.0, across, 0.0}));
  Body part = body("object", Box{{0.1, 0.1, 0.1}}, 1.0, {-side, 0.0, 0.0}, Role::object);
  part.linear_factor = Vector3::UnitX();
  part.angular_factor = Vector3::Zero();
  scene.add_body(part);
  scene.add_spring({"bench", "object", Vector3::Zero(), Vector3::Zero(), stiffness, rest, 0.0});
  const Problem problem = escape_from(scene, ~Region(regions::Ball{"object", {side, 0.0, 0.0}, 0.1}));
  const EscapeEnergy found = escape(problem, 300);
  EXPECT_NEAR(found.energy, 0.5 * stiffness * (rest - across) * (rest - across), 1e-6);
  expect_path_leads_out_over_its_barrier(found, problem);
}

TEST_P(Fixture, ConstantForceCountsAsGravityDoes) {
  Problem problem = lift(0.2);
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  Body block = problem.scene.body("object");
  block.force = {0.0, 0.0, 5.0};
  scene.add_body(block);
  problem.scene = scene;
  EXPECT_NEAR(escape(problem, 300).energy, (g - 5.0) * 0.2, 1e-6);
}

TEST_P(Fixture, WeightActsAtTheCentreOfMassAndNotAtTheFrame) {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}, {0.0, 0.0, -5.0}));
  Body pendulum = body("object", Box{{0.1, 0.1, 0.4}}, 1.0, Vector3::Zero(), Role::object);
  pendulum.inertial = Inertial{{0.0, 0.0, -0.1}, {0.01, 0.01, 0.01}, Quaternion::Identity()};
  pendulum.linear_factor = Vector3::Zero();
  pendulum.angular_factor = Vector3::UnitX();
  scene.add_body(pendulum);
  Problem problem = escape_from(scene, regions::Tilt{"object", Vector3::UnitZ(), Vector3::UnitZ(), 1.0});
  problem.torque = Vector3::UnitX();
  // Held at its centre of mass, it turns for nothing.
  EXPECT_EQ(escape(problem, 300).energy, 0.0);
}

TEST_P(Fixture, ClosedBoxIsACage) {
  const EscapeEnergy found = escape(closed_box(), 1000);
  EXPECT_EQ(found.energy, infinity);
  EXPECT_TRUE(found.history.empty());
  EXPECT_EQ(found.path.rows(), 0);
  EXPECT_EQ(found.barrier, -1);
}

TEST_P(Fixture, DiscSlidesOutThroughAGapWiderThanItself) {
  const Problem problem = disc_behind_a_gap(0.12);
  const EscapeEnergy found = escape(problem, 2000);
  EXPECT_EQ(found.energy, 0.0);
  expect_path_leads_out_over_its_barrier(found, problem);
}

TEST_P(Fixture, DiscIsCagedBehindAGapNarrowerThanItself) {
  EXPECT_EQ(escape(disc_behind_a_gap(0.095), 2000).energy, infinity);
}

TEST_P(Fixture, PlanarObjectStaysInItsPlane) {
  const EscapeEnergy found = escape(disc_behind_a_gap(0.12), 2000);
  for (Eigen::Index i = 0; i < found.path.rows(); ++i) {
    EXPECT_EQ(found.path(i, 2), 0.0);
    EXPECT_NEAR(found.path(i, 3), 0.0, 1e-15);
    EXPECT_NEAR(found.path(i, 4), 0.0, 1e-15);
  }
}

TEST_P(Fixture, SupportCarriesForNothing) {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}, Vector3::Zero(), 10.0));
  scene.add_body(body("object", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, 0.1}, Role::object, 10.0));
  EXPECT_EQ(escape(escape_from(scene, regions::Disc{"object", Vector2::Zero(), 0.5}), 1000).energy, 0.0);
}

TEST_P(Fixture, BoundsMayCloseTheCheapWay) {
  Problem problem = ball_in_pen();
  Scene scene = pen(0.1, 0.02, rim);
  scene.add_body(fixed("step", Box{{0.05, 0.2, 0.05}}, {0.155, 0.0, 0.025}));
  problem.within = regions::HalfSpace{"object", -Vector3::UnitZ(), -0.05};  // above 0.05 alone
  problem.state[2] = 0.06;
  const EscapeEnergy found = escape(problem, 1000);
  ASSERT_LT(found.energy, infinity);
  const Membership within(*problem.within, problem.scene);
  for (Eigen::Index i = 0; i < found.path.rows(); ++i) EXPECT_TRUE(within(State(found.path.row(i)))) << "row " << i;
}

TEST_P(Fixture, ObjectThatIsOutsideAlreadyNeedsNoEnergy) {
  Problem problem = ball_in_pen();
  problem.captured = regions::Disc{"object", {9.0, 9.0}, 0.1};
  const EscapeEnergy found = escape(problem, 100);
  EXPECT_EQ(found.energy, 0.0);
  EXPECT_EQ(found.history, (std::vector<std::pair<int, double>>{{0, 0.0}}));
  EXPECT_EQ(found.path.rows(), 1);
}

TEST_P(Fixture, CaptureSetIsLookedAtAtRest) {
  Problem problem = ball_in_pen();
  problem.captured = problem.captured & regions::Speed{"object", 0.1};
  problem.state[StateLayout::velocities_of_body] = 3.0;
  EXPECT_GT(escape(problem, 100).energy, 0.0);
}

TEST_P(Fixture, MoreSamplesNeverMakeItWorse) {
  double before = infinity;
  for (const int samples : {60, 100, 200, 300, 500}) {
    const double energy = escape(box_in_pen(0.1), samples, 3).energy;
    EXPECT_LE(energy, before) << samples << " samples";
    before = energy;
  }
  EXPECT_LT(before, infinity);
}

TEST_P(Fixture, SameSeedGivesTheSameBitsInAnyOrderOnAnyThread) {
  constexpr int seeds = 6;
  std::vector<EscapeEnergy> forward(seeds), backward(seeds);
  std::thread one([&] {
    for (int i = 0; i < seeds; ++i) forward[i] = escape(box_in_pen(0.1), 200, static_cast<std::uint64_t>(i));
  });
  std::thread other([&] {
    for (int i = seeds; i-- > 0;) backward[i] = escape(box_in_pen(0.1), 200, static_cast<std::uint64_t>(i));
  });
  one.join();
  other.join();
  for (int i = 0; i < seeds; ++i) {
    EXPECT_TRUE(same_bits(forward[i].energy, backward[i].energy)) << "seed " << i;
    EXPECT_TRUE(same_bits(forward[i].path, backward[i].path)) << "seed " << i;
    EXPECT_EQ(forward[i].history, backward[i].history) << "seed " << i;
  }
  EXPECT_LT(forward[0].energy, infinity);
  EXPECT_FALSE(same_bits(forward[0].path, forward[1].path));
}

TEST_P(Fixture, OneOfSeveralObjectsEscapesWhileTheOthersStay) {
  Scene scene = pen(0.1, 0.02, rim);
  scene.add_body(body("heavy", Sphere{0.03}, 2.0, {-0.05, 0.0, 0.03}, Role::object));
  scene.add_body(body("light", Sphere{0.03}, 0.2, {0.05, 0.0, 0.03}, Role::object));
  const auto in = [](const std::string& name) {
    return Region(regions::Box{name, Vector3::Zero(), {0.4, 0.4, infinity}});
  };
  const Problem problem = problem_of(scene, Vector3::Ones(), Vector3::Zero(), 0.3, in("heavy") & in("light"));
  for (const auto& [name, mass] : {std::pair{"heavy", 2.0}, {"light", 0.2}}) {
    EscapeEnergyOptions options;
    options.planner = GetParam();
    options.samples = 1000;
    options.object = name;
    const EscapeEnergy found = escape_energy(problem, options);
    EXPECT_NEAR(found.energy, mass * g * rim, 0.02 * mass * g * rim) << name;
    const int other = StateLayout(scene).offset(scene.index(name == std::string("heavy") ? "light" : "heavy"));
    const States still = found.path.middleCols(other, StateLayout::numbers_per_body);
    EXPECT_EQ(still, still.row(0).replicate(still.rows(), 1));
  }
}

TEST_P(Fixture, CancelledAtOnceNothingIsFound) {
  const std::atomic<bool> cancel{true};
  EscapeEnergyOptions options;
  options.planner = GetParam();
  options.limit = Limit(&cancel);
  const EscapeEnergy found = escape_energy(ball_in_pen(), options);
  EXPECT_FALSE(found.complete);
  EXPECT_EQ(found.samples, 0);
  EXPECT_EQ(found.energy, infinity);
  EXPECT_EQ(found.path.rows(), 0);
}

TEST_P(Fixture, TimeoutGivesTheBestSoFar) {
  EscapeEnergyOptions options;
  options.planner = GetParam();
  options.samples = 1000000;
  EscapeEnergy timed;
  for (double timeout = 0.1; timed.history.empty(); timeout *= 2.0) {
    options.limit = Limit(nullptr, timeout);
    timed = escape_energy(ball_in_pen(), options);
  }
  ASSERT_FALSE(timed.complete);
  ASSERT_LT(timed.samples, 1000000);
  EXPECT_EQ(timed.energy, timed.history.back().second);
  EXPECT_GT(timed.path.rows(), 0);
  options.limit = {};
  options.samples = 2 * timed.samples;
  const EscapeEnergy more = escape_energy(ball_in_pen(), options);
  EXPECT_TRUE(more.complete);
  // The last escape may have been found, and not yet relaxed to the end.
  ASSERT_GE(more.history.size(), timed.history.size());
  EXPECT_TRUE(std::equal(timed.history.begin(), timed.history.end() - 1, more.history.begin()));
  EXPECT_LE(more.energy, timed.energy);
}

EscapeEnergyOptions with(const std::string& planner, int samples) {
  EscapeEnergyOptions options;
  options.planner = planner;
  options.samples = samples;
  return options;
}

TEST(EscapeEnergyOptions, BadOptionsAndProblemsAreRejectedByNameAndValue) {
  EXPECT_TRUE(rejects([] { escape_energy(ball_in_pen(), with("prm", 10)); }, {"planner", "'prm'", "'bit*' or 'rrt*'"}));
  EXPECT_TRUE(rejects([] { escape_energy(ball_in_pen(), with("bit*", 0)); }, {"samples", "0", "at least 1"}));
  EscapeEnergyOptions options;
  for (const double reach : {0.0, -1.0, nan, infinity}) {
    options.reach = reach;
    EXPECT_TRUE(rejects([&] { escape_energy(ball_in_pen(), options); }, {"reach", "above 0"}));
  }
  options.reach = 0.01;
  EXPECT_TRUE(rejects([&] { escape_energy(ball_in_pen(), options); }, {"reach", "0.01", "outside of its capture set"}));
  options.reach.reset();
  options.object = "floor";
  EXPECT_TRUE(rejects([&] { escape_energy(ball_in_pen(), options); }, {"object", "'floor'", "'object'"}));
  Problem problem = ball_in_pen();
  problem.within = regions::Disc{"object", {9.0, 9.0}, 0.1};
  EXPECT_TRUE(rejects([&] { escape_energy(problem); }, {"within", "state"}));
}

TEST(EscapeEnergyOptions, CaptureSetWithoutAnOutsideIsRejectedByTheNameOfReach) {
  Problem problem = ball_in_pen();
  problem.captured = regions::HalfSpace{"object", Vector3::UnitZ(), 1e9};
  EXPECT_TRUE(rejects([&] { escape_energy(problem); }, {"reach", "not given"}));
}

TEST(EscapeEnergyOptions, ObjectThatCollidesWithNothingIsRejected) {
  Scene scene;
  Body ghost = body("object", Compound{}, 1.0, Vector3::Zero(), Role::object);
  ghost.inertial = Inertial{Vector3::Zero(), {0.1, 0.1, 0.1}, Quaternion::Identity()};
  scene.add_body(ghost);
  const Problem problem = escape_from(scene, regions::Ball{"object", Vector3::Zero(), 1.0});
  EXPECT_TRUE(rejects([&] { escape_energy(problem); }, {"object", "'object'", "no parts"}));
}

TEST(EscapeEnergyOptions, OneOfSeveralObjectsHasToBeNamed) {
  Problem problem = ball_in_pen();
  problem.scene.add_body(body("second", Sphere{0.01}, 0.2, {-0.05, 0.0, 0.01}, Role::object));
  problem.state = pack(problem.scene);
  EXPECT_TRUE(rejects([&] { escape_energy(problem); }, {"object", "not given", "'object' or 'second'"}));
}

}  // namespace
}  // namespace energymargin

// A lower bound of the effort of escape: against closed forms, on cages, and where nothing is certain.

#include "energymargin/metrics/lower_bound.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double weight = 0.2 * g;

Body in_plane(Body body) {
  body.linear_factor = Vector3(1.0, 1.0, 0.0);
  body.angular_factor = Vector3::UnitZ();
  return body;
}

Region within(double half) { return regions::Box{"object", Vector3::Zero(), {2.0 * half, 2.0 * half, infinity}}; }

Problem escape_from(const Scene& scene, const Region& captured) {
  return problem_of(scene, scene.body("object").linear_factor, Vector3::Zero(), 0.3, captured);
}

// Four walls of 2 cm around a square of half edge 10 cm, whose eastern one has a gap.
Scene pen(double gap, const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity);
  const double half = 0.5 * (0.24 - gap);
  scene.add_body(fixed("west", Box{{0.02, 0.24, 0.2}}, {-0.11, 0.0, 0.0}));
  scene.add_body(fixed("north", Box{{0.24, 0.02, 0.2}}, {0.0, 0.11, 0.0}));
  scene.add_body(fixed("south", Box{{0.24, 0.02, 0.2}}, {0.0, -0.11, 0.0}));
  scene.add_body(fixed("upper", Box{{0.02, half, 0.2}}, {0.11, 0.5 * (gap + half), 0.0}));
  scene.add_body(fixed("lower", Box{{0.02, half, 0.2}}, {0.11, -0.5 * (gap + half), 0.0}));
  return scene;
}

constexpr double bar_width = 0.04;

Problem bar_in_pen(double gap) {
  Scene scene = pen(gap);
  scene.add_body(in_plane(body("object", Box{{0.12, bar_width, 0.04}}, 0.2, Vector3::Zero(), Role::object)));
  return escape_from(scene, within(0.2));
}

// A ball of 3 cm on the ground between walls of 10 cm.
Problem ball_in_pen(const std::vector<Body>& others = {}) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("floor", Plane{}));
  for (const double side : {-1.0, 1.0}) {
    scene.add_body(fixed(side < 0 ? "west" : "east", Box{{0.02, 0.24, 0.1}}, {0.11 * side, 0.0, 0.05}));
    scene.add_body(fixed(side < 0 ? "south" : "north", Box{{0.24, 0.02, 0.1}}, {0.0, 0.11 * side, 0.05}));
  }
  scene.add_body(body("object", Sphere{0.03}, 0.2, {0.0, 0.0, 0.03}, Role::object));
  for (const Body& other : others) scene.add_body(other);
  return escape_from(scene, within(0.11));
}

LowerBound bound_of(const Problem& problem, int cells = 20'000) {
  LowerBoundOptions options;
  options.cells = cells;
  return effort_lower_bound(problem, options);
}

TEST(LowerBound, of_a_ball_behind_walls_is_a_little_less_than_its_weight_over_them) {
  const LowerBound bound = bound_of(ball_in_pen());
  EXPECT_LE(bound.effort, weight * 0.1);
  EXPECT_GE(bound.effort, weight * 0.1 * 0.85);
  EXPECT_EQ(bound.barrier, bound.effort);
  EXPECT_TRUE(bound.reason.empty());
}

TEST(LowerBound, rises_with_the_cells_and_is_never_wrong_for_lack_of_them) {
  double last = 0.0;
  for (const int cells : {1, 10, 100, 1000, 10'000}) {
    const LowerBound bound = bound_of(ball_in_pen(), cells);
    EXPECT_GE(bound.effort, last) << cells;
    EXPECT_LE(bound.effort, weight * 0.1) << cells;
    EXPECT_LE(bound.cells, cells + 1);
    last = bound.effort;
  }
  EXPECT_GT(last, 0.0);
}

TEST(LowerBound, proves_a_closed_pen_to_be_a_cage) {
  const LowerBound bound = bound_of(bar_in_pen(0.0));
  EXPECT_TRUE(bound.cage());
  EXPECT_TRUE(bound.complete);
}

TEST(LowerBound, tells_a_gap_that_is_too_narrow_from_one_that_is_wide_enough) {
  EXPECT_TRUE(bound_of(bar_in_pen(0.9 * bar_width)).cage());
  EXPECT_FALSE(bound_of(bar_in_pen(1.05 * bar_width)).cage());
}

TEST(LowerBound, of_what_turns_freely_is_that_of_a_ball_inside) {
  Problem problem = ball_in_pen({fixed("lid", Box{{0.3, 0.3, 0.02}}, {0.0, 0.0, 0.11})});
  EXPECT_TRUE(bound_of(problem, 100'000).cage());
  Scene scene = pen(0.0, Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("floor", Plane{}, {0.0, 0.0, -0.05}));
  scene.add_body(body("object", Box{{0.12, 0.06, 0.1}}, 0.2, Vector3::Zero(), Role::object));
  const LowerBound bound = bound_of(escape_from(scene, within(0.11)));
  // The ball of 3 cm begins 2 cm above the floor, and the walls end 10 cm above the middle.
  EXPECT_LE(bound.effort, weight * 0.13);
  EXPECT_GE(bound.effort, weight * 0.13 * 0.85) << bound.reason << " " << bound.stored << " " << bound.barrier;
}

TEST(LowerBound, leaves_out_bodies_that_can_move) {
  Problem problem = bar_in_pen(0.1);
  problem.scene.add_body(in_plane(body("gate", Box{{0.02, 0.1, 0.2}}, 0.1, {0.11, 0.0, 0.0}, Role::effector)));
  problem.state = pack(problem.scene);
  EXPECT_EQ(bound_of(problem).effort, 0.0);
}

TEST(LowerBound, takes_off_the_kinetic_energy_of_the_start) {
  Problem problem = ball_in_pen();
  BodyState moving;
  moving.position = Vector3(0.0, 0.0, 0.03);
  moving.velocity = Vector3(0.5, 0.0, 0.0);
  problem.state = pack(problem.scene, {{"object", moving}});
  const LowerBound bound = bound_of(problem);
  EXPECT_NEAR(bound.kinetic, 0.5 * 0.2 * 0.25, 1e-12);
  EXPECT_DOUBLE_EQ(bound.effort, bound.barrier - bound.kinetic);
}

TEST(LowerBound, takes_off_what_a_spring_between_others_can_release) {
  Problem problem = ball_in_pen({fixed("far", Box{{0.1, 0.1, 0.1}}, {5.0, 0.0, 0.0}),
                                 body("bob", Box{{0.1, 0.1, 0.1}}, 0.1, {5.0, 0.0, 0.05}, Role::effector)});
  problem.scene.disable_collisions("far", "bob");
  problem.scene.add_spring({"far", "bob", Vector3::Zero(), Vector3::Zero(), 8.0, 0.15, 0.0});
  problem.state = pack(problem.scene);
  EXPECT_NEAR(bound_of(problem).stored, 0.5 * 8.0 * 0.1 * 0.1, 1e-3);
}

TEST(LowerBound, of_a_heavy_body_that_may_fall_is_0_with_the_reason) {
  const LowerBound on_ground =
      bound_of(ball_in_pen({body("weight", Box{{0.1, 0.1, 0.1}}, 5.0, {1.0, 0.0, 0.05}, Role::effector)}));
  EXPECT_GT(on_ground.effort, 0.0);
  const LowerBound above =
      bound_of(ball_in_pen({body("weight", Box{{0.1, 0.1, 0.1}}, 5.0, {1.0, 0.0, 1.05}, Role::effector)}));
  EXPECT_NEAR(above.stored, 5.0 * g * 1.0, 1e-6);
  EXPECT_EQ(above.effort, 0.0);
  EXPECT_NE(above.reason.find("can give"), std::string::npos) << above.reason;
  Problem floating = ball_in_pen({body("weight", Box{{0.1, 0.1, 0.1}}, 5.0, {1.0, 0.0, 0.05}, Role::effector)});
  floating.scene.disable_collisions("weight", "floor");
  const LowerBound bound = bound_of(floating);
  EXPECT_TRUE(std::isinf(bound.stored));
  EXPECT_NE(bound.reason.find("'weight' may fall"), std::string::npos) << bound.reason;
}

TEST(LowerBound, of_an_effector_that_does_work_is_0_but_of_a_cage) {
  const Body pusher = body("pusher", Box{{0.1, 0.1, 0.1}}, 1.0, {1.0, 0.0, 0.05}, Role::effector);
  Problem problem = ball_in_pen({pusher});
  problem.effector = Effector::drive;
  EXPECT_GT(bound_of(problem).effort, 0.0);
  BodyState moving = pusher.state;
  moving.velocity = Vector3(-0.1, 0.0, 0.0);
  problem.state = pack(problem.scene, {{"pusher", moving}});
  EXPECT_EQ(bound_of(problem).effort, 0.0);
  EXPECT_NE(bound_of(problem).reason.find("\"drive\""), std::string::npos);
  problem.scene.add_body(fixed("lid", Box{{0.3, 0.3, 0.02}}, {0.0, 0.0, 0.11}));
  EXPECT_TRUE(bound_of(problem, 100'000).cage());
}

TEST(LowerBound, of_a_capture_set_that_goes_along_is_0_with_the_reason) {
  Problem problem = ball_in_pen({body("hand", Sphere{0.01}, 0.1, {0.5, 0.0, 0.01}, Role::effector)});
  problem.captured = regions::Ball{"object", Vector3::Zero(), 2.0, "hand"};
  EXPECT_NE(bound_of(problem).reason.find("goes along with 'hand'"), std::string::npos) << bound_of(problem).reason;
}

// A bar that stands on the ground of a plane, whose frame is 5 cm beside its centre of mass.
Problem lifted_bar(regions::Point point) {
  Scene scene(Vector3(0.0, -g, 0.0));
  scene.add_body(fixed("floor", Plane{Vector3::UnitY(), -0.02}));
  Body bar = in_plane(body("object", Box{{0.04, 0.04, 0.04}}, 0.2, {-0.05, 0.0, 0.0}, Role::object));
  bar.shape = Compound{{Part{Box{{0.04, 0.04, 0.04}}, {{0.05, 0.0, 0.0}, Quaternion::Identity()}}}, {}};
  scene.add_body(bar);
  return escape_from(scene, regions::HalfSpace{"object", Vector3::UnitY(), 0.1, "", 0.0, point});
}

TEST(LowerBound, of_a_region_about_the_centre_of_mass_is_the_weight_to_its_border) {
  const LowerBound center = bound_of(lifted_bar(regions::Point::center_of_mass));
  EXPECT_LE(center.effort, weight * 0.1);
  EXPECT_GE(center.effort, weight * 0.1 * 0.95);
  // A turn brings the frame above the centre of mass, half of the way up.
  const LowerBound origin = bound_of(lifted_bar(regions::Point::origin));
  EXPECT_LE(origin.effort, weight * 0.05);
  EXPECT_GE(origin.effort, weight * 0.05 * 0.8);
}

TEST(LowerBound, of_a_speed_is_the_kinetic_energy_that_it_takes) {
  Problem problem = ball_in_pen({fixed("lid", Box{{0.3, 0.3, 0.02}}, {0.0, 0.0, 0.11})});
  problem.captured = regions::Speed{"object", 2.0};
  const LowerBound bound = bound_of(problem);
  const double kinetic = 0.5 * 0.2 * 4.0;
  EXPECT_LE(bound.effort, kinetic);
  EXPECT_GE(bound.effort, 0.9 * kinetic);
}

Problem box_on_a_table() {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("object", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.0, 0.05}, Role::object));
  return problem_of(scene, Vector3::Constant(20.0), Vector3::Constant(0.2), 0.3, regions::Speed{"object", 0.2});
}

// No coordinate matters: the first front is the last one.
TEST(LowerBound, of_a_set_of_speeds_alone_proves_no_cage) {
  const Region slow = regions::Speed{"object", 0.2};
  for (const Region& set :
       {slow, slow | Region(regions::Speed{"object", 0.1}), slow & Region(regions::Speed{"object", 0.3})}) {
    Problem problem = box_on_a_table();
    problem.captured = set;
    problem.captured_any = set;
    EffortOptions options;
    options.nodes = 200;
    const double effort = escape_effort(problem, options).effort;
    for (const Captured captured : {Captured::all, Captured::any}) {
      LowerBoundOptions of;
      of.captured = captured;
      const LowerBound bound = effort_lower_bound(problem, of);
      EXPECT_GT(bound.effort, 0.0);
      EXPECT_LE(bound.effort, std::min(effort, 0.5 * 0.2 * 0.2));
    }
  }
}

TEST(LowerBound, of_a_set_that_is_left_by_standing_still_is_0) {
  Problem problem = box_on_a_table();
  BodyState moving;
  moving.position = Vector3(0.0, 0.0, 0.05);
  moving.velocity = Vector3(1.0, 0.0, 0.0);
  problem.state = pack(problem.scene, {{"object", moving}});
  problem.captured = ~Region(regions::Speed{"object", 0.2});
  EXPECT_EQ(bound_of(problem).effort, 0.0);
}

// A mass on a spring: 95 % of the way out, at rest. A step of a stiff one overshoots.
TEST(LowerBound, holds_for_stiff_springs_as_they_are_simulated) {
  for (const double stiffness : {10.0, 1000.0, 8000.0}) {
    Scene scene(Vector3::Zero());
    scene.add_body(fixed("wall", Sphere{0.01}, {-1.0, 0.0, 0.0}));
    Body mass = body("object", Sphere{0.02}, 0.2, {0.095, 0.0, 0.0}, Role::object);
    mass.linear_factor = Vector3::UnitX();
    mass.angular_factor = Vector3::Zero();
    scene.add_body(mass);
    scene.add_spring({"wall", "object", Vector3::Zero(), Vector3::Zero(), stiffness, 1.0});
    Problem problem = problem_of(scene, Vector3::UnitX(), Vector3::Zero(), 0.1,
                                 regions::Box{"object", Vector3::Zero(), {0.2, infinity, infinity}});
    problem.horizon = 1.0;
    EffortOptions options;
    options.nodes = 200;
    const double bound = bound_of(problem).effort;
    EXPECT_LE(bound, escape_effort(problem, options).effort) << stiffness;
    const double work = 0.5 * stiffness * (0.1 * 0.1 - 0.095 * 0.095);
    EXPECT_GT(bound, stiffness < 100.0 ? 0.9 * work : -1.0) << stiffness;
  }
}

TEST(LowerBound, of_several_objects_is_the_least_of_all_and_the_most_of_any) {
  Problem problem = ball_in_pen({body("free", Sphere{0.03}, 0.2, {1.0, 0.0, 0.03}, Role::object)});
  const Region held = within(0.11);
  const Region loose = regions::Disc{"free", {1.0, 0.0}, 0.1};
  problem.captured = held & loose;
  problem.captured_any = held | loose;
  EXPECT_EQ(bound_of(problem).effort, 0.0);
  LowerBoundOptions any;
  any.captured = Captured::any;
  any.cells = 20'000;
  EXPECT_GE(effort_lower_bound(problem, any).effort, weight * 0.1 * 0.85);
}

TEST(LowerBound, is_never_above_an_escape) {
  Problem problem = ball_in_pen();
  problem.force = Vector3::Constant(2.0 * weight);
  EffortOptions options;
  options.nodes = 500;
  const double effort = escape_effort(problem, options).effort;
  EXPECT_LT(effort, infinity);
  EXPECT_LE(bound_of(problem).effort, effort);
}

TEST(LowerBound, at_its_limit_is_what_is_certain_so_far) {
  const std::atomic<bool> cancelled{true};
  LowerBoundOptions options;
  options.limit = Limit(&cancelled);
  const LowerBound bound = effort_lower_bound(ball_in_pen(), options);
  EXPECT_FALSE(bound.complete);
  EXPECT_LE(bound.effort, weight * 0.1);
}

TEST(LowerBound, refuses_bad_options) {
  LowerBoundOptions options;
  options.cells = 0;
  EXPECT_TRUE(rejects([&] { effort_lower_bound(ball_in_pen(), options); }, {"cells is 0"}));
  options.cells = 10;
  options.tolerance = 0.0;
  EXPECT_TRUE(rejects([&] { effort_lower_bound(ball_in_pen(), options); }, {"tolerance is 0"}));
}

}  // namespace
}  // namespace energymargin

// What friction holds: grips at Coulomb's limit, towers, and rollouts that are cut in two.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "energymargin/world.hpp"
#include "mechanisms.hpp"
#include "rollouts.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;
constexpr double cube_mass = 0.5;
constexpr double pad_friction = 0.6;

enum class Hold { free, pushed_link, driven_link };

// A cube of 6 cm in the air between two pads, which press at `load` times what its weight needs. Pads move along x
// only.
struct Grip {
  Scene scene{Vector3(0.0, 0.0, -g)};
  Plan script;
};

Grip grip(Hold hold, double pad_mass, double load, int steps) {
  Grip made;
  const double force = cube_mass * g / (2.0 * pad_friction * load);
  made.scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
  made.scene.add_body(body("object", Box{{0.06, 0.06, 0.06}}, cube_mass, Vector3::Zero(), Role::object, 1.0));
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "left" : "right";
    Body pad = body(name, Box{{0.02, 0.04, 0.04}}, pad_mass, {0.04 * side, 0.0, 0.0}, Role::effector, pad_friction);
    if (hold == Hold::free) {
      pad.linear_factor = Vector3::UnitX();
      pad.angular_factor = Vector3::Zero();
    }
    made.scene.add_body(pad);
    if (hold != Hold::driven_link) {
      made.script.wrenches.push_back(steady(name, {-side * force, 0.0, 0.0}, Vector3::Zero(), steps));
    }
    if (hold == Hold::free) continue;
    Joint slide = joint(name, JointType::prismatic, "post", name, {-side, 0.0, 0.0}, {0.04 * side, 0.0, -1.0});
    if (hold == Hold::driven_link) {
      slide.stiffness = 1e4;
      slide.damping = 100.0;
      slide.target = 0.1;  // out of reach: the drive gives all it has
      slide.torque_limit = force;
    }
    made.scene.add_joint(slide);
  }
  return made;
}

// How far the cube sinks, and how fast it does in the end.
Vector2 sinking(Hold hold, double pad_mass, double load, int steps) {
  const Grip made = grip(hold, pad_mass, load, steps);
  const Frame end = World(made.scene).simulate(pack(made.scene), made.script, steps, {steps}).front();
  EXPECT_EQ(end.unconverged, 0);
  EXPECT_EQ(end.lost_time, 0.0);
  const BodyState at = body_in(made.scene, end.state, "object");
  return {-at.position.z(), -at.velocity.z()};
}

TEST(Grip, HoldsBelowCoulombsLimitAndDropsAboveItByWhatFrictionLacks) {
  for (const Hold hold : {Hold::free, Hold::pushed_link, Hold::driven_link}) {
    for (const double pad_mass : {0.01, 2.0}) {
      const Vector2 held = sinking(hold, pad_mass, 0.97, 240);
      EXPECT_LT(held.cwiseAbs().maxCoeff(), 1e-5) << static_cast<int>(hold) << ", " << pad_mass;
      const double excess = g * (1.0 - 1.0 / 1.03);
      const Vector2 dropped = sinking(hold, pad_mass, 1.03, 60);  // not further than the pads
      EXPECT_NEAR(dropped.y(), excess * 60.0 * step, 1e-3 * excess) << static_cast<int>(hold) << ", " << pad_mass;
    }
  }
}

// Farthest that any of the bodies was from where it began.
double wander(const Scene& scene, int steps) {
  double most = 0.0;
  const State start = pack(scene);
  for (const State& state : trajectory(scene, start, steps)) {
    const Unpacked now = unpack(scene, state);
    for (const auto& [name, at] : unpack(scene, start).bodies) {
      most = std::max(most, (now.bodies.at(name).position - at.position).norm());
    }
  }
  return most;
}

// Cubes of 5 cm on each other, of these masses from below.
Scene cubes(const std::vector<double>& masses) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const double height = 0.025 + 0.05 * static_cast<double>(i);
    scene.add_body(body("cube " + std::to_string(i), Box{{0.05, 0.05, 0.05}}, masses[i], {0.0, 0.0, height},
                        i == 0 ? Role::object : Role::none));
  }
  return scene;
}

TEST(Grip, TowerOfTenCubesStandsStill) { EXPECT_LT(wander(cubes(std::vector<double>(10, 0.1)), 720), 1e-4); }

TEST(Grip, OneKilogramRestsOnTenGrams) { EXPECT_LT(wander(cubes({0.01, 1.0}), 720), 5e-4); }

// What rounding a state changes is lost in a tight tolerance.
Scene tight(const Scene& plain) {
  Stepping stepping;
  stepping.tolerance = 1e-9;
  Scene scene(plain.gravity(), stepping);
  for (const Body& made : plain.bodies()) scene.add_body(made);
  for (const Joint& made : plain.joints()) scene.add_joint(made);
  return scene;
}

TEST(Grip, RolloutThatIsCutInTwoEndsWhereTheWholeOneDoes) {
  for (const Scene& scene : {tight(crowded_push()), tight(compounds()), tight(hand(1.0, true))}) {
    World world(scene);
    const Wrench wrench{{0.3, 0.2, 0.0}, {0.0, 0.0, 0.01}};
    const Disturbance wrenches(scene.with_role(Role::object).size(), wrench);
    const Rollout whole = world.rollout_unchecked(pack(scene), {push(wrenches, 120)});
    const Rollout half = world.rollout_unchecked(pack(scene), {push(wrenches, 60)});
    const Rollout rest = world.rollout_unchecked(half.state, {push(wrenches, 60)});
    EXPECT_LT((rest.state - whole.state).cwiseAbs().maxCoeff(), 1e-9) << scene.bodies().back().name;
    EXPECT_NEAR(half.effort + rest.effort, whole.effort, 1e-9) << scene.bodies().back().name;
  }
}

}  // namespace
}  // namespace energymargin

// What a simulation returns is a state: whatever takes a state takes it.

#include <gtest/gtest.h>

#include "energymargin/plan.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "random_mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A simulation may diverge, which returns no state.
template <typename Simulation>
void run(const Simulation& simulation) {
  try {
    simulation();
  } catch (const Diverged&) {
  }
}

// Everything that takes a state, but a problem, takes it.
void expect_taken(World& world, const State& state) {
  const Scene& scene = world.scene();
  const Disturbance none(scene.with_role(Role::object).size());
  EXPECT_NO_THROW(validate(scene, state));
  EXPECT_NO_THROW(unpack(scene, state));
  EXPECT_NO_THROW(world.energy(state));
  EXPECT_NO_THROW(run([&] { world.rollout(state, {none}, 2.0 * scene.stepping().step); }));
  EXPECT_NO_THROW(run([&] { world.simulate(state, {}, 2, {1, 2}); }));
  EXPECT_NO_THROW(hold(scene, state, scene.stepping().step));
}

// `state` with its joints of limited range far beyond a limit.
State bent(const Scene& scene, State state) {
  const StateLayout layout(scene);
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    const Joint& joint = scene.joints()[i];
    if (!joint.moves() || !std::isfinite(joint.upper)) continue;
    state[layout.joint_offset(i)] = joint.upper + 0.3 * (joint.upper - joint.lower);
  }
  return state;
}

// How many joints of the states are beyond what is plausible at a stop.
std::size_t beyond(const Scene& scene, const std::vector<State>& states) {
  std::size_t count = 0;
  for (const State& state : states) count += implausible_joints(scene, state).size();
  return count;
}

TEST(ReturnedState, OfRandomMechanismsIsTakenByEverythingAlsoBeyondTheLimitsOfJoints) {
  std::size_t states = 0;
  std::size_t joints_beyond = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Scene scene = random_mechanisms(seed);
    World world(scene);
    std::vector<State> ends;
    for (Question& asked : hurled_questions(scene, 20, 60)) {
      if (ends.size() % 4 == 3) asked = {bent(scene, pack(scene)), asked.wrenches, 1};
      run([&] { ends.push_back(world.rollout_unchecked(asked.state, {push(asked.wrenches, asked.steps)}).state); });
    }
    for (const State& end : ends) expect_taken(world, end);
    states += ends.size();
    joints_beyond += beyond(scene, ends);
  }
  EXPECT_GE(states, 390u) << "of 400";
  EXPECT_GT(joints_beyond, 0u) << "no state of this test is beyond a limit";
}

TEST(ReturnedState, OfRandomMechanismsIsTheStartOfAProblem) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Scene scene = random_mechanisms(seed);
    World world(scene);
    Problem problem = problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.1, regions::Ball{"object"});
    for (const Question& asked : questions(scene, 20, 60)) {
      problem.state = world.rollout(asked.state, asked.wrenches, asked.steps * scene.stepping().step).state;
      EXPECT_NO_THROW(validate(problem));
    }
  }
}

TEST(ReturnedState, OfBodiesWithLockedAxesAndOtherCentresOfMassIsTakenByEverything) {
  Scene scene;
  scene.add_body(fixed("ground", Plane{}));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  for (int i = 0; i < 6; ++i) {
    Body thrown = body("body " + std::to_string(i), Box{{0.1, 0.08, 0.06}}, 0.3, {0.07 * i, 0.03 * i, 0.031},
                       i == 0 ? Role::object : Role::effector);
    if (i % 2 == 1) thrown.inertial = Inertial{{0.01, -0.02, 0.01}, {4e-4, 5e-4, 6e-4}, turn(0.3, Vector3::UnitX())};
    if (i % 3 != 0) thrown.linear_factor = {1.0, 1.0, 0.0};
    if (i % 3 == 2) thrown.angular_factor = {0.0, 0.0, 1.0};
    thrown.state.angular_velocity = Vector3(0.0, 0.0, 3.0 * even(random));
    thrown.state.velocity = Vector3(even(random), even(random), 0.0);
    scene.add_body(thrown);
  }
  World world(scene);
  for (const Question& asked : questions(scene, 60, 60)) {
    expect_taken(world, world.rollout(asked.state, asked.wrenches, asked.steps * scene.stepping().step).state);
  }
}

}  // namespace
}  // namespace energymargin

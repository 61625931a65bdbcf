// Feedback: what it is by hand, its memory, its file.

#include <gtest/gtest.h>

#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/problem_io.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using scenes::body;
using scenes::fixed;

Scene ball_in_space() {
  Scene scene(Vector3::Zero());
  scene.add_body(body("ball", Sphere{0.05}, 2.0, {0.03, 0.0, 0.0}, Role::object));
  return scene;
}

Feedback spring(double stiffness, double damping, double period) {
  Feedback law;
  law.period = period;
  law.observed = {"ball.x", "ball.vx"};
  law.corrected = {"ball.fx"};
  law.gains = {Eigen::RowVector2d(stiffness, damping)};
  law.references = Eigen::RowVector2d::Zero();
  return law;
}

Plan plan_with(const Feedback& law) {
  Plan plan;
  plan.step = law.period;
  return with_feedback(plan, law);
}

// A body "scale" of 1 kg has the impulse of a force as its momentum.
Feedback weighed(const Scene& scene, const std::string& force) {
  Feedback law;
  law.period = scene.stepping().step;
  law.observed = {force};
  law.corrected = {"scale.fx"};
  law.gains = {Eigen::MatrixXd::Constant(1, 1, -1.0)};
  law.references = Eigen::MatrixXd::Zero(1, 1);
  return law;
}

State after(const Scene& scene, const Plan& plan, int steps) {
  World world(scene, plan);
  return world.rollout(pack(scene), Disturbance(1), steps * scene.stepping().step).state;
}

TEST(Feedback, ActsFromOneControlTimeToTheNextAsByHand) {
  const Scene scene = ball_in_space();
  const double h = scene.stepping().step, k = 50.0, d = 3.0;
  for (const int steps_of_period : {1, 3}) {
    for (const int delay : {0, 2}) {
      Feedback law = spring(k, d, steps_of_period * h);
      law.delay = delay;
      double x = 0.03, v = 0.0;
      std::vector<double> queue(static_cast<std::size_t>(delay) + 1, 0.0);
      for (int step = 0; step < 60; ++step) {
        if (step % steps_of_period == 0) {
          queue.erase(queue.begin());
          queue.push_back(-k * x - d * v);
        }
        v += h * queue.front() / 2.0;
        x += h * v;
      }
      const State state = after(scene, plan_with(law), 60);
      EXPECT_NEAR(state[0], x, 1e-12);
      EXPECT_NEAR(state[StateLayout::velocities_of_body], v, 1e-12);
    }
  }
}

TEST(Feedback, OfThatPeriodHasItsRateInTheMean) {
  const Scene scene = ball_in_space();
  Feedback law = spring(0.0, 0.0, 1.0 / 50.0);
  law.references = Eigen::MatrixXd::Zero(51, 2);
  law.references(50, 0) = 1.0;  // of the control time of 1 s, which is step 240
  law.gains = {Eigen::RowVector2d(48.0, 0.0)};
  for (const int steps : {240, 241}) {
    Feedback free = law;
    free.gains = {Eigen::RowVector2d::Zero()};
    free.gains.resize(51, Eigen::RowVector2d::Zero());
    free.gains[50] = law.gains[0];
    const double speed = after(scene, plan_with(free), steps)[StateLayout::velocities_of_body];
    const double pushed = steps == 240 ? 0.0 : 48.0 * (1.0 - 0.03) / 2.0 * scene.stepping().step;
    EXPECT_NEAR(speed, pushed, 1e-12);
  }
}

TEST(Feedback, StopsAtItsLimits) {
  const Scene scene = ball_in_space();
  Feedback law = spring(1e4, 0.0, scene.stepping().step);
  law.low = Eigen::VectorXd::Constant(1, -4.0);
  law.high = Eigen::VectorXd::Constant(1, 4.0);
  const double h = scene.stepping().step;
  EXPECT_NEAR(after(scene, plan_with(law), 10)[StateLayout::velocities_of_body], -4.0 / 2.0 * 10 * h, 1e-12);
}

TEST(Feedback, RolloutThatIsCutGoesOnWithItsMemory) {
  const Scene scene = ball_in_space();
  Feedback law = spring(50.0, 3.0, 7 * scene.stepping().step);
  law.delay = 2;
  World world(scene, plan_with(law));
  const Push none{Eigen::VectorXd::Zero(6), 60};
  const Rollout whole = world.rollout_unchecked(pack(scene), {none});
  ASSERT_EQ(whole.state.size(), world.layout().dimension() + world.memory());
  for (const int cut : {1, 6, 7, 20, 33}) {
    const Rollout first = world.rollout_unchecked(pack(scene), {{none.wrenches, cut}});
    Watch watch;
    watch.first = cut;
    const Rollout rest = world.rollout_unchecked(first.state, {{none.wrenches, 60 - cut}}, {}, watch);
    EXPECT_EQ(rest.state, whole.state) << cut;
  }
}

TEST(Feedback, ForceOfAContactIsThatOfTheLastStep) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("box", Box{{0.1, 0.1, 0.1}}, 2.0, {0.0, 0.0, 0.05}, Role::object));
  scene.add_body(body("scale", Sphere{0.05}, 1.0, {5.0, 0.0, 0.5}));
  const double h = scene.stepping().step;
  const State state = after(scene, plan_with(weighed(scene, "force(box, table)")), 40);
  const int speed = StateLayout(scene).offset(2) + StateLayout::velocities_of_body;
  EXPECT_NEAR(state[speed] / (39 * h), 2.0 * 9.81, 0.05);  // none is known in the first step
}

// A ball that falls touches within a step, and then rests: its weight was borne on average since it was let go.
TEST(Feedback, ForceOfAStepIsTheMeanOverItsSubsteps) {
  for (const double restitution : {0.0, 0.3}) {
    Scene scene;
    scene.add_body(fixed("table", Plane{}));
    Body ball = body("ball", Sphere{0.05}, 2.0, {0.0, 0.0, 0.2}, Role::object);
    ball.surface = Surface{};
    ball.surface->restitution = restitution;
    scene.add_body(ball);
    scene.add_body(body("scale", Sphere{0.05}, 1.0, {5.0, 0.0, 100.0}));
    const int steps = 480;
    const State state = after(scene, plan_with(weighed(scene, "force(ball, table)")), steps);
    const int speed = StateLayout(scene).offset(2) + StateLayout::velocities_of_body;
    EXPECT_NEAR(state[speed] / ((steps - 1) * scene.stepping().step), 2.0 * 9.81, 1e-3) << restitution;
  }
}

TEST(Feedback, SearchGoesOnWithTheMemoryOfItsNodes) {
  const Scene scene = ball_in_space();
  const auto effort = [&](int delay) {
    Problem problem(scene, pack(scene), regions::Ball{"ball", {0.0, 0.0, 0.0}, 0.1});
    problem.force = {4.0, 4.0, 4.0};
    problem.duration = 0.1;
    problem.horizon = 1.0;
    Feedback law = spring(80.0, 4.0, 12 * scene.stepping().step);
    law.delay = delay;
    problem.plan = plan_with(law);
    EffortOptions options;
    options.nodes = 300;
    options.seed = 3;
    return escape_effort(problem, options);
  };
  const auto found = effort(0);
  ASSERT_TRUE(std::isfinite(found.effort));
  EXPECT_EQ(found.tree.states.cols(), StateLayout(scene).dimension());
}

TEST(Feedback, IsReadAsItIsWritten) {
  const Scene scene = ball_in_space();
  Feedback law = spring(50.0, 3.0, 0.02);
  law.delay = 1;
  law.start = 0.3;
  law.low = Eigen::VectorXd::Constant(1, -std::numeric_limits<double>::infinity());
  law.high = Eigen::VectorXd::Constant(1, 7.0);
  law.references = Eigen::MatrixXd::Random(4, 2);
  law.gains.push_back(Eigen::RowVector2d(1.0 / 3.0, 2.0));
  const Plan plan = plan_with(law);
  const std::string text = to_json(plan);
  const Plan back = plan_from_json(text);
  EXPECT_EQ(to_json(back), text);
  EXPECT_EQ(back.feedback->references, law.references);
  EXPECT_EQ(back.feedback->gains[1], law.gains[1]);
  EXPECT_EQ(after(scene, back, 60), after(scene, plan, 60));
}

TEST(Policy, IsReadWithItsCodeByItsName) {
  Feedback law;
  law.period = 0.05;
  law.observed = {"ball.x"};
  law.corrected = {"ball.fx"};
  law.delay = 1;
  auto policy = std::make_shared<Policy>();
  policy->memory = 2;
  Plan plan;
  plan.step = law.period;
  plan.policy = policy;
  plan = with_feedback(plan, law);
  EXPECT_TRUE(rejects([&] { to_json(plan); }, {"Policy without name="}));
  policy->name = "net";
  const std::string text = to_json(plan);
  const Plan back = plan_from_json(text, {{"net", plan}});
  EXPECT_EQ(to_json(back), text);
  EXPECT_EQ(back.policy, policy);
  EXPECT_TRUE(rejects([&] { plan_from_json(text); }, {"plan.policy", "\"net\"", "no file has"}));
  Plan other = plan;
  other.feedback->delay = 0;
  EXPECT_TRUE(rejects([&] { plan_from_json(text, {{"net", other}}); }, {"delay none", "1"}));
}

TEST(Feedback, WhatDoesNotFitIsRefusedByName) {
  const Scene scene = ball_in_space();
  const auto refused = [&](const std::function<void(Feedback&)>& change, std::initializer_list<std::string> words) {
    Feedback law = spring(50.0, 3.0, 0.02);
    change(law);
    return rejects([&] { World(scene, plan_with(law)); }, words);
  };
  EXPECT_TRUE(refused([](Feedback& law) { law.period = 1e-4; }, {"step", "0.0001"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.delay = -1; }, {"delay", "-1"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.gains = {Eigen::MatrixXd::Zero(2, 2)}; }, {"gains", "(2, 2)", "(1, 2)"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.references = Eigen::MatrixXd::Zero(1, 3); }, {"references", "(1, 3)"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.observed[0] = "ball.q"; }, {"observed", "ball.q", "b.rz"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.observed[0] = "force(ball, ball)"; }, {"observed", "force(ball, ball)"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.corrected[0] = "j"; }, {"corrected", "'j'", "targets"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.corrected[0] = "cube.fx"; }, {"cube"}));
  EXPECT_TRUE(refused([](Feedback& law) { law.low = Eigen::VectorXd::Zero(1); }, {"limits"}));
}

}  // namespace
}  // namespace energymargin

// A push: what a rollout step, a capture score and an effort of escape cost.

#include <benchmark/benchmark.h>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"

namespace {

using namespace energymargin;

Body moving(const std::string& name, const Shape& shape, double mass, const Vector3& position, Role role) {
  Body body;
  body.name = name;
  body.shape = shape;
  body.mass = mass;
  body.state.position = position;
  body.friction = 0.3;
  body.role = role;
  return body;
}

Problem push() {
  Scene scene;
  Body table;
  table.name = "table";
  table.shape = Plane{};
  table.friction = 0.3;
  scene.add_body(table);
  scene.add_body(moving("object", Box{{1.2, 0.4, 0.1}}, 1.0, {1.0, 0.4, 0.05}, Role::object));
  Body effector = moving("effector", Cylinder{0.1, 0.1}, 4.0, {1.0, 0.1, 0.05}, Role::effector);
  effector.state.velocity = {0.0, 0.4, 0.0};
  scene.add_body(effector);
  Problem problem{scene, pack(scene), {0.8, 0.8, 0.0}, {0.0, 0.0, 0.05}, 0.5, regions::Disc{"object", {1.0, 0.4}, 0.3}};
  problem.effector = Effector::drive;
  return problem;
}

void rollout(benchmark::State& run) {
  const Problem problem = push();
  World world(problem.scene);
  const int steps = static_cast<int>(run.range(0));
  for (auto _ : run) benchmark::DoNotOptimize(world.rollout_unchecked(problem.state, {Wrench{}}, steps));
  run.SetItemsProcessed(run.iterations() * steps);
}
BENCHMARK(rollout)->Arg(1)->Arg(10)->Arg(88)->Unit(benchmark::kMicrosecond);

void capture(benchmark::State& run) {
  const Problem problem = push();
  CaptureOptions options;
  options.nodes = static_cast<int>(run.range(0));
  for (auto _ : run) benchmark::DoNotOptimize(capture_score(problem, options));
}
BENCHMARK(capture)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

void effort(benchmark::State& run, const std::string& planner) {
  const Problem problem = push();
  const EffortOptions options{planner, static_cast<int>(run.range(0)), 0, nullptr};
  for (auto _ : run) benchmark::DoNotOptimize(escape_effort(problem, options));
}
BENCHMARK_CAPTURE(effort, est, "est")->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(effort, rrt, "rrt")->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace

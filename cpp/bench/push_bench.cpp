// A push: what a rollout step, a capture score and an effort of escape cost, in time and memory.

#include <benchmark/benchmark.h>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "peak_memory.hpp"
#include "push_problem.hpp"

namespace {

using namespace energymargin;

void rollout(benchmark::State& run) {
  const Problem problem = push();
  World world(problem.scene);
  const int steps = static_cast<int>(run.range(0));
  for (auto _ : run) benchmark::DoNotOptimize(world.rollout_unchecked(problem.state, {push({Wrench{}}, steps)}));
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

// One tree, in rounds of 16 nodes, on so many threads.
void capture_in_rounds(benchmark::State& run) {
  const Problem problem = push();
  CaptureOptions options;
  options.nodes_per_round = 16;
  options.threads = static_cast<int>(run.range(0));
  for (auto _ : run) benchmark::DoNotOptimize(capture_score(problem, options));
}
BENCHMARK(capture_in_rounds)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// This search spends all its nodes, while the improved one ends once it finds that the pusher itself loses the box.
EffortOptions published(const std::string& planner, int nodes) {
  return {planner, nodes, 0, Captured::all, {}, Search::published};
}

void effort(benchmark::State& run, const std::string& planner) {
  const Problem problem = push();
  const EffortOptions options = published(planner, static_cast<int>(run.range(0)));
  for (auto _ : run) benchmark::DoNotOptimize(escape_effort(problem, options));
}
BENCHMARK_CAPTURE(effort, est, "est")->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(effort, rrt, "rrt")->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

// Peak resident memory of a search over its nodes. One run: a second one would find the first one's memory. Short edges
// take less time, and as much memory.
template <typename Search>
void count_bytes(benchmark::State& run, const Search& search) {
  Problem problem = push();
  problem.duration = 0.05;
  const int nodes = static_cast<int>(run.range(0));
  for (auto _ : run) {
    const PeakMemory memory;
    search(problem, nodes);
    run.counters["bytes_per_node"] = memory.grown() / nodes;
  }
}

void capture_memory(benchmark::State& run) {
  count_bytes(run, [](const Problem& problem, int nodes) {
    CaptureOptions options;
    options.nodes = nodes;
    benchmark::DoNotOptimize(capture_score(problem, options));
  });
}
BENCHMARK(capture_memory)->Arg(30000)->Iterations(1)->Unit(benchmark::kSecond);

void effort_memory(benchmark::State& run, const std::string& planner) {
  count_bytes(run, [&](const Problem& problem, int nodes) {
    benchmark::DoNotOptimize(escape_effort(problem, published(planner, nodes)));
  });
}
BENCHMARK_CAPTURE(effort_memory, est, "est")->Arg(30000)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(effort_memory, rrt, "rrt")->Arg(30000)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace

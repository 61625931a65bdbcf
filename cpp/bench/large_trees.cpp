// energymargin_large_trees [--edge SECONDS] [NODES ...]: grows capture trees of a push, and prints their time and peak
// memory. Shorter edges take less time, and as much memory.

#include <chrono>
#include <cstdio>
#include <ctime>
#include <string>
#include <thread>
#include <vector>

#include "energymargin/metrics/capture.hpp"
#include "peak_memory.hpp"
#include "push_problem.hpp"

namespace {

using namespace energymargin;

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double seconds() { return std::chrono::duration<double>(Limit::Clock::now().time_since_epoch()).count(); }

void grow(const Problem& problem, int nodes) {
  CaptureOptions options;
  options.nodes = nodes;
  const PeakMemory memory;
  const double start = cpu_seconds();
  const CaptureScore score = capture_score(problem, options);
  const double took = cpu_seconds() - start;
  std::printf("| %d | %.1f | %.0f | %.0f | %.6f |\n", score.nodes(), took, memory.grown() / 1e6, memory.grown() / nodes,
              score.capture.mean);
  std::fflush(stdout);
}

// The time from a cancel in the midst of a large tree to the score of what there is.
void cancel(const Problem& problem, int nodes) {
  std::atomic<bool> flag{false};
  CaptureOptions options;
  options.nodes = 1000000000;
  options.limit = Limit(&flag);
  std::atomic<double> set{0.0};
  // About when the tree has so many nodes: measured on a small one.
  CaptureOptions small;
  const double start = seconds();
  capture_score(problem, small);
  const double pause = (seconds() - start) * nodes / small.nodes;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::duration<double>(pause));
    set = seconds();
    flag = true;
  });
  const CaptureScore score = capture_score(problem, options);
  const double waited = seconds() - set;
  canceller.join();
  std::printf("cancelled at %d nodes: the score was there after %.3f s\n", score.nodes(), waited);
}

}  // namespace

int main(int argc, char** argv) {
  Problem problem = push();
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) {
    if (argv[i] == std::string("--edge") && i + 1 < argc) {
      problem.duration = std::stod(argv[++i]);
    } else {
      sizes.push_back(std::stoi(argv[i]));
    }
  }
  if (sizes.empty()) sizes = {10000, 100000, 1000000};
  std::printf("| nodes | time on one core [s] | peak memory [MB] | bytes a node | capture |\n");
  std::printf("| --- | --- | --- | --- | --- |\n");
  for (const int nodes : sizes) grow(problem, nodes);
  cancel(problem, sizes.back());
}

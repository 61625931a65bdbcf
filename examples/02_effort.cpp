// Reads a problem file and prints the least work found that takes an object out, and how: 02_effort PROBLEM.json
//
// examples/02_effort.py does the same in Python, to the last bit.

#include <cstdio>
#include <energymargin/energymargin.hpp>

namespace em = energymargin;

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: 02_effort PROBLEM.json\n"), 2;
  const em::Problem problem = em::load(argv[1]);

  for (const char* planner : {"est", "rrt"}) {
    em::EffortOptions options;
    options.planner = planner;
    options.nodes = 300;
    const em::Escape escape = em::escape_effort(problem, options);
    std::printf("%s: %.6f J\n", planner, escape.effort);
    for (const int node : escape.path) {
      std::printf("  after %.3f s and %.6f J\n", escape.tree.times()[node], escape.tree.costs[node]);
    }
  }
}

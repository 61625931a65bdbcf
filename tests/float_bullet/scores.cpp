// Scores a problem file and prints every digit.

#include <cstdio>
#include <energymargin/energymargin.hpp>

void print_scores(const char* file) {
  const energymargin::Problem problem = energymargin::load(file);
  energymargin::EffortOptions options;
  options.nodes = 100;
  std::printf("effort %.17g J\n", energymargin::escape_effort(problem, options).effort);
  energymargin::World world(problem.scene);
  const auto rollout = world.rollout(problem.state, energymargin::Wrench{problem.force, problem.torque}, 0.5);
  for (const double number : rollout.state) std::printf("%.17g\n", number);
}

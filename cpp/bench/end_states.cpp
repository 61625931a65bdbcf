// energymargin_end_states [--save FILE] [--against FILE] PROBLEM.json ...
// 1,000 rollouts under random wrenches, shared out over the problems: the time of a step, and where the objects end.
// What a change of the simulation moves is seen against the ends that were saved before it, and beside what half the
// step moves.

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/problem_io.hpp"
#include "energymargin/search/tree.hpp"

namespace {

using namespace energymargin;

constexpr int rollouts = 1000;
constexpr std::uint64_t seed = 0;
constexpr int rounds = 5;  // of timing

struct Start {
  std::size_t problem;
  Disturbance wrenches;
  int steps;
};

double even(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1.0p-53;
}

std::vector<Start> draw(const std::vector<Problem>& problems) {
  std::mt19937_64 random(seed);
  std::vector<Start> starts;
  for (std::size_t i = 0; i < rollouts; ++i) {
    const std::size_t which = i % problems.size();
    const search::Edge largest = search::largest_edge(problems[which]);
    Start start{which, {}, 0};
    for (Eigen::Index at = 0; at < largest.wrenches.size(); at += 6) {
      Wrench wrench;
      for (int axis = 0; axis < 3; ++axis) {
        wrench.force[axis] = even(random, -1.0, 1.0) * largest.wrenches[at + axis];
        wrench.torque[axis] = even(random, -1.0, 1.0) * largest.wrenches[at + 3 + axis];
      }
      start.wrenches.push_back(wrench);
    }
    start.steps = 1 + static_cast<int>(even(random, 0.0, largest.steps));
    starts.push_back(std::move(start));
  }
  return starts;
}

struct Ends {
  std::vector<double> numbers;  // of all states, one after the other
  double step_time = 0.0;       // the least of the rounds [s]
};

Scene in_finer_steps(const Scene& scene, int finer) {
  Stepping stepping = scene.stepping();
  stepping.step /= finer;
  Scene made(scene.gravity(), stepping);
  for (const Body& body : scene.bodies()) made.add_body(body);
  for (const Joint& joint : scene.joints()) made.add_joint(joint);
  for (const Spring& spring : scene.springs()) made.add_spring(spring);
  for (const auto& [a, b] : scene.disabled_collisions()) made.disable_collisions(a, b);
  return made;
}

// With steps that are `finer` times shorter.
Ends run(const std::vector<Problem>& problems, const std::vector<Start>& starts, int finer) {
  std::vector<World> worlds;
  for (const Problem& problem : problems) {
    worlds.emplace_back(in_finer_steps(problem.scene, finer));
  }
  Ends ends;
  for (int round = 0; round < rounds; ++round) {
    ends.numbers.clear();
    long steps = 0;
    const std::clock_t begin = std::clock();
    for (const Start& start : starts) {
      const Rollout rollout = worlds[start.problem].rollout_unchecked(problems[start.problem].state,
                                                                      {push(start.wrenches, finer * start.steps)});
      steps += rollout.steps;
      ends.numbers.insert(ends.numbers.end(), rollout.state.begin(), rollout.state.end());
      ends.numbers.push_back(rollout.effort);
    }
    const double took = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / steps;
    if (round == 0 || took < ends.step_time) ends.step_time = took;
  }
  return ends;
}

// How far the objects' places are apart [m], sorted.
std::vector<double> moved(const std::vector<Problem>& problems, const std::vector<Start>& starts, const Ends& a,
                          const std::vector<double>& b) {
  std::vector<double> distances;
  std::size_t at = 0;
  for (const Start& start : starts) {
    const Scene& scene = problems[start.problem].scene;
    const StateLayout layout(scene);
    double farthest = 0.0;
    for (const std::size_t object : scene.with_role(Role::object)) {
      const std::size_t place = at + static_cast<std::size_t>(layout.offset(object));
      const Vector3 apart(a.numbers[place] - b[place], a.numbers[place + 1] - b[place + 1],
                          a.numbers[place + 2] - b[place + 2]);
      farthest = std::max(farthest, apart.norm());
    }
    distances.push_back(farthest);
    at += static_cast<std::size_t>(layout.dimension()) + 1;
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

void print(const char* what, const std::vector<double>& distances) {
  const auto at = [&](double share) {
    return 1e3 * distances[static_cast<std::size_t>(share * (distances.size() - 1))];
  };
  const auto same = std::count(distances.begin(), distances.end(), 0.0);
  std::printf("%s: moved by %.3g mm (median), %.3g (mean), %.3g (95 %%), %.3g (most); %ld did not move\n", what,
              at(0.5), 1e3 * std::accumulate(distances.begin(), distances.end(), 0.0) / distances.size(), at(0.95),
              at(1.0), static_cast<long>(same));
}

void run(const std::vector<std::string>& words) {
  std::string save, against;
  std::vector<Problem> problems;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--save") {
      save = words.at(++i);
    } else if (words[i] == "--against") {
      against = words.at(++i);
    } else {
      problems.push_back(load(words[i]));
    }
  }
  if (problems.empty()) throw std::invalid_argument("no problem file is given");
  const std::vector<Start> starts = draw(problems);
  const Ends now = run(problems, starts, 1);
  std::printf("%.3f us a step\n", 1e6 * now.step_time);
  print("half the step", moved(problems, starts, now, run(problems, starts, 2).numbers));
  if (!against.empty()) {
    std::ifstream file(against, std::ios::binary);
    std::vector<double> before(now.numbers.size());
    const auto size = static_cast<std::streamsize>(before.size() * sizeof(double));
    file.read(reinterpret_cast<char*>(before.data()), size);
    if (file.gcount() != size || file.peek() != EOF) {
      throw std::invalid_argument("'" + against + "' does not hold the ends of these problems");
    }
    print("since saved", moved(problems, starts, now, before));
    std::printf("%s\n", before == now.numbers ? "all bits the same" : "bits differ");
  }
  if (!save.empty()) {
    std::ofstream(save, std::ios::binary)
        .write(reinterpret_cast<const char*>(now.numbers.data()),
               static_cast<std::streamsize>(now.numbers.size() * sizeof(double)));
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "energymargin_end_states: %s\n", error.what());
    return 1;
  }
}

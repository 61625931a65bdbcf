// energymargin_rollouts PROBLEM.json [--nodes M ...] [--rounds R] [--alone] [--duration S] [--steps N]: what rollouts
// cost.
//
// Grows a capture tree of M nodes, R times, and each time lets Bullet replay the tree's edges: the floor. Ours and
// floor take turns, so that what else the machine does disturbs both. --alone: no floor, and peak memory instead.
// --duration: of the longest edge. --steps: no tree, but one rollout of so many steps without a wrench. Prints JSON;
// times are of the CPU [s], lengths in [m].

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/problem_io.hpp"
#include "peak_memory.hpp"

namespace {

using namespace energymargin;
using Json = nlohmann::ordered_json;

struct Edge {
  State start;
  Disturbance wrenches;
  int steps;
  State end;
};

std::vector<Edge> edges(const Problem& problem, const Tree& tree) {
  const EdgeStart edge_start(problem);
  std::vector<Edge> made;
  for (int node = 1; node < tree.size(); ++node) {
    Edge edge{edge_start(tree.states.row(tree.parents[node])), {}, 0, tree.states.row(node)};
    for (Eigen::Index i = 0; i < tree.controls.cols(); i += 6) {
      edge.wrenches.push_back({tree.controls.row(node).segment<3>(i), tree.controls.row(node).segment<3>(i + 3)});
    }
    edge.steps = static_cast<int>(std::lround(tree.durations[node] / problem.scene.stepping().step));
    made.push_back(std::move(edge));
  }
  return made;
}

// Returns how many steps that took; `visit` sees each edge, and the state at its end.
template <typename Visit>
long replay(World& bullet, const std::vector<Edge>& edges, const Visit& visit) {
  long steps = 0;
  for (const Edge& edge : edges) {
    visit(edge, bullet.rollout_unchecked(edge.start, {push(edge.wrenches, edge.steps)}).state);
    steps += edge.steps;
  }
  return steps;
}

template <typename Job>
double cpu_seconds(const Job& job) {
  const std::clock_t start = std::clock();
  job();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How far the objects went along the edges, and how far from there the floor left them.
void compare(const Problem& problem, World& bullet, const std::vector<Edge>& edges, Json& result) {
  const StateLayout layout(problem.scene);
  const std::vector<std::size_t> objects = problem.scene.with_role(Role::object);
  std::vector<double> moved, apart;
  replay(bullet, edges, [&](const Edge& edge, const State& there) {
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const auto position = [&](const State& state) { return state.segment<3>(layout.offset(objects[i])); };
      moved.push_back((position(edge.end) - position(edge.start)).norm());
      apart.push_back((position(edge.end) - position(there)).norm());
    }
  });
  result["moved"] = median(moved);
  result["apart"] = median(apart);
}

Json pairs(const Problem& problem, const CaptureOptions& options, int rounds) {
  World bullet(problem.scene.with_engine(EngineKind::bullet));
  Json result{{"nodes", options.nodes}};
  for (int round = 0; round < rounds; ++round) {
    CaptureScore score;
    result["ours"].push_back(cpu_seconds([&] { score = capture_score(problem, options); }));
    const std::vector<Edge> made = edges(problem, score.trees.front());
    long floor_steps = 0;
    result["others"].push_back(
        cpu_seconds([&] { floor_steps = replay(bullet, made, [](const Edge&, const State&) {}); }));
    if (round > 0) continue;
    result["steps"] = std::lround(score.trees.front().durations.sum() / problem.scene.stepping().step);
    result["others_steps"] = floor_steps;
    compare(problem, bullet, made, result);
  }
  return result;
}

Json alone(const Problem& problem, const CaptureOptions& options, int rounds) {
  Json result{{"nodes", options.nodes}};
  const PeakMemory memory;
  for (int round = 0; round < rounds; ++round) {
    result["ours"].push_back(cpu_seconds([&] { capture_score(problem, options); }));
    if (round == 0) result["bytes"] = memory.grown();
  }
  return result;
}

// One rollout from the start in place of a tree.
Json straight(const Problem& problem, int steps, int rounds) {
  World world(problem.scene);
  World bullet(problem.scene.with_engine(EngineKind::bullet));
  const std::size_t objects = problem.scene.with_role(Role::object).size();
  Edge edge{problem.state, Disturbance(objects), steps, problem.state};
  Json result;
  for (int round = 0; round < rounds; ++round) {
    result["ours"].push_back(
        cpu_seconds([&] { edge.end = world.rollout_unchecked(problem.state, {push(edge.wrenches, steps)}).state; }));
    result["others"].push_back(cpu_seconds([&] { replay(bullet, {edge}, [](const Edge&, const State&) {}); }));
  }
  result["steps"] = result["others_steps"] = steps;
  compare(problem, bullet, {edge}, result);
  return result;
}

void run(const std::vector<std::string>& arguments) {
  Problem problem = load(arguments[0]);
  std::vector<int> sizes;
  int rounds = 3, steps = 0;
  bool is_alone = false;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i] == "--alone") {
      is_alone = true;
    } else if (arguments[i] == "--rounds") {
      rounds = std::stoi(arguments.at(++i));
    } else if (arguments[i] == "--steps") {
      steps = std::stoi(arguments.at(++i));
    } else if (arguments[i] == "--duration") {
      problem.duration = std::stod(arguments.at(++i));
    } else if (arguments[i] != "--nodes") {
      sizes.push_back(std::stoi(arguments[i]));
    }
  }
  Json runs = Json::array();
  if (steps > 0) {
    runs.push_back(straight(problem, steps, rounds));
  } else if (sizes.empty()) {
    sizes = {100, 1000};
  }
  for (const int nodes : sizes) {
    CaptureOptions options;
    options.nodes = nodes;
    runs.push_back(is_alone ? alone(problem, options, rounds) : pairs(problem, options, rounds));
  }
  std::cout << runs.dump(2) << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: energymargin_rollouts PROBLEM.json [--nodes M ...] [--rounds R] [--alone] [--duration S] "
                 "[--steps N]\n";
    return 2;
  }
  try {
    run({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "energymargin_rollouts: " << error.what() << '\n';
    return 1;
  }
}

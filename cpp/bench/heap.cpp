// energymargin_heap [BODIES ...]: what a step of a heap costs.
//
// Boxes and balls fall onto a table and come to rest in a heap, for a quarter of a second, in ours and in a stock
// Bullet world, which has a broadphase of its own: a tree of bounds. Prints JSON; times are of the CPU [s].

#include <cmath>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "energymargin/random.hpp"
#include "raw_scene.hpp"

namespace {

using namespace energymargin;

constexpr int steps = 60;
constexpr double size = 0.1;   // of a body [m]
constexpr double pitch = 1.1;  // of the lattice that they fall from, in sizes

Scene heap(int bodies) {
  Scene scene;
  Body table;
  table.name = "table";
  table.shape = Plane{};
  scene.add_body(table);
  const int edge = static_cast<int>(std::ceil(std::cbrt(bodies)));
  for (int i = 0; i < bodies; ++i) {
    Body body;
    body.name = std::to_string(i);
    body.shape = i % 2 == 0 ? Shape(Box{Vector3::Constant(size)}) : Shape(Sphere{0.5 * size});
    body.mass = 0.2;
    body.role = Role::object;
    const auto shift = [i](int axis) {  // [m]
      return 0.05 * size * std::sin(static_cast<double>(stream(7, 3 * static_cast<std::size_t>(i + axis)) % 1000));
    };
    body.state.position = pitch * size * Vector3(i % edge, (i / edge) % edge, i / (edge * edge) + 0.5);
    body.state.position += Vector3(shift(0), shift(1), 0.0);
    scene.add_body(body);
  }
  return scene;
}

template <typename Job>
double cpu_seconds(const Job& job) {
  const std::clock_t start = std::clock();
  job();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

nlohmann::ordered_json measure(int bodies) {
  const Scene scene = heap(bodies);
  const State start = pack(scene);
  const Disturbance none(static_cast<std::size_t>(bodies));
  std::optional<World> world;
  nlohmann::ordered_json result{{"bodies", bodies}};
  result["made"] = cpu_seconds([&] { world.emplace(scene); });
  result["ours"] = cpu_seconds([&] { world->rollout_unchecked(start, none, steps); }) / steps;
  RawScene raw(scene);
  raw.set(start);
  result["others"] = cpu_seconds([&] {
                       for (int i = 0; i < steps; ++i) raw.step(none);
                     }) /
                     steps;
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (int i = 1; i < argc; ++i) runs.push_back(measure(std::stoi(argv[i])));
  if (argc == 1) {
    for (const int bodies : {10, 100, 1000}) runs.push_back(measure(bodies));
  }
  std::cout << runs.dump(2) << '\n';
}

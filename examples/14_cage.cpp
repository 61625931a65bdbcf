// A ball in a box without a lid: the least work that takes it out is m g h, and with a lid there is no way out, which
// is proved.
//
// examples/14_cage.py does the same in Python.

#include <cstdio>
#include <energymargin/energymargin.hpp>

namespace em = energymargin;

constexpr double side = 0.12, height = 0.06, radius = 0.02, mass = 0.05;  // m, m, m, kg

void add_wall(em::Scene& scene, const char* name, const em::Vector3& size, const em::Vector3& position) {
  em::Body wall;
  wall.name = name;
  wall.shape = em::Box{size};
  wall.mass = 0.0;
  wall.state.position = position;
  scene.add_body(wall);
}

em::Problem problem(bool lid) {
  em::Scene scene;
  add_wall(scene, "floor", {side, side, 0.01}, {0, 0, -0.005});
  add_wall(scene, "left", {0.01, side, height}, {-side / 2, 0, height / 2});
  add_wall(scene, "right", {0.01, side, height}, {side / 2, 0, height / 2});
  add_wall(scene, "front", {side, 0.01, height}, {0, -side / 2, height / 2});
  add_wall(scene, "back", {side, 0.01, height}, {0, side / 2, height / 2});
  if (lid) add_wall(scene, "lid", {side, side, 0.01}, {0, 0, height + 0.005});

  em::Body ball;
  ball.name = "ball";
  ball.shape = em::Sphere{radius};
  ball.mass = mass;
  ball.state.position = {0, 0, radius};
  ball.role = em::Role::object;
  scene.add_body(ball);

  em::Problem asked(scene, em::pack(scene), em::regions::Ball{"ball", {0, 0, 0}, 0.15});
  asked.force = {1.0, 1.0, 1.0};
  asked.torque = {0.0, 0.0, 0.0};
  asked.duration = 0.2;
  return asked;
}

int main() {
  em::LowerBoundOptions options;
  options.cells = 20'000;
  for (const bool lid : {false, true}) {
    const em::LowerBound bound = em::effort_lower_bound(problem(lid), options);
    std::printf("%s a lid: no way out takes less than %.4f J\n", lid ? "with" : "without", bound.effort);
  }
  std::printf("over the wall: %.4f J\n", mass * 9.81 * height);
}

// A scene of your own: a pusher moves a box over a table. Will the box stay in front of it for the next half second?
//
// examples/03_own_scene.py does the same in Python, to the last bit.

#include <cstdio>
#include <energymargin/energymargin.hpp>

namespace em = energymargin;

int main() {
  em::Scene scene;

  em::Body table;
  table.name = "table";
  table.shape = em::Plane{};
  table.friction = 0.5;
  scene.add_body(table);

  em::Body box;
  box.name = "box";
  box.shape = em::Box{{0.10, 0.06, 0.04}};
  box.mass = 0.2;
  box.state.position = {0.0, 0.0, 0.02};
  box.friction = 0.4;
  box.role = em::Role::object;
  scene.add_body(box);

  em::Body pusher;
  pusher.name = "pusher";
  pusher.shape = em::Cylinder{0.01, 0.04};
  pusher.mass = 0.5;
  pusher.state.position = {0.0, -0.042, 0.02};
  pusher.state.velocity = {0.0, 0.1, 0.0};
  pusher.friction = 0.4;
  pusher.role = em::Role::effector;
  scene.add_body(pusher);

  const em::regions::Ball in_front{"box", {0.0, 0.04, 0.0}, 0.05, "pusher"};
  em::Problem problem(scene, em::pack(scene), in_front);
  problem.force = {1.0, 1.0, 0.0};                     // the largest disturbance along each axis [N]
  problem.torque = {0.0, 0.0, 0.02};                   // and about each axis [N m]
  problem.duration = 0.2;                              // the longest disturbance [s]
  problem.plan = em::hold(scene, problem.state, 0.5);  // the pusher goes on as it moves

  em::ProbabilityOptions options;
  options.rollouts = 100;
  const em::CaptureProbability p = em::capture_probability(problem, options);
  const em::Interval interval = em::interval(p.all.captured(), p.effective);
  std::printf("captured for 0.5 s: %.6f, 95 %% interval %.6f to %.6f\n", p.all.captured(), interval.low, interval.high);
  std::printf("without a disturbance it %s\n", p.undisturbed ? "stays" : "leaves");
}

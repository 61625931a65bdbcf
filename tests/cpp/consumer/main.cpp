// A user's own program: is a free ball captured in a small one's reach? Prints the capture score.

#include <energymargin/metrics/capture.hpp>
#include <iostream>

int main() {
  energymargin::Scene scene(energymargin::Vector3::Zero());
  energymargin::Body ball;
  ball.name = "ball";
  ball.shape = energymargin::Sphere{0.1};
  ball.mass = 1.0;
  ball.role = energymargin::Role::object;
  scene.add_body(ball);
  energymargin::Problem problem(scene, energymargin::pack(scene),
                                energymargin::regions::Ball{"ball", {0.0, 0.0, 0.0}, 0.01});
  problem.force = {1.0, 0.0, 0.0};
  energymargin::CaptureOptions options;
  options.nodes = 50;
  const double capture = energymargin::capture_score(problem, options).capture.mean;
  std::cout << "capture " << capture << "\n";
  return capture > 0.0 && capture < 1.0 ? 0 : 1;
}

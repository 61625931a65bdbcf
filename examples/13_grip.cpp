// Two fingers that press with F hold 2 mu F, and not more: a limit that is known on paper.
//
// examples/13_grip.py does the same in Python.

#include <cstdio>
#include <energymargin/energymargin.hpp>
#include <string>

namespace em = energymargin;

constexpr double force = 10.0, friction = 0.5, mass = 0.8;  // N of each finger, of finger and cube, kg

em::Body box(const std::string& name, const em::Vector3& size, double kilograms, em::Role role) {
  em::Body body;
  body.name = name;
  body.shape = em::Box{size};
  body.mass = kilograms;
  body.role = role;
  return body;
}

int main() {
  em::Scene scene;
  em::Body palm = box("palm", {0.12, 0.04, 0.02}, 0.0, em::Role::effector);
  palm.state.position = {0, 0, 0.30};
  scene.add_body(palm);
  em::Body cube = box("cube", {0.04, 0.04, 0.04}, mass, em::Role::object);
  cube.state.position = {0, 0, 0.24};
  scene.add_body(cube);

  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "left" : "right";
    scene.add_body(box(name, {0.01, 0.02, 0.02}, 0.1, em::Role::effector));
    em::Joint slide;
    slide.name = name + "_slide";
    slide.type = em::JointType::prismatic;
    slide.parent = "palm";
    slide.child = name;
    slide.in_parent.position = {side * 0.05, 0, -0.06};
    slide.axis = {-side, 0, 0};
    slide.lower = 0.0;
    slide.upper = 0.05;
    slide.state.position = 0.025;  // the finger touches
    slide.target = 0.035;          // 1 cm inside: 50 N, so the force acts
    slide.stiffness = 5000.0;
    slide.damping = 10.0;
    slide.torque_limit = force;
    scene.add_joint(slide);
    scene.set_friction({name, "cube", friction});
  }

  em::World world(scene);
  const em::State held = em::pack(scene);
  for (const double share : {0.97, 1.03}) {
    const double pull = share * 2 * friction * force - 9.81 * mass;  // N, beside the weight
    const em::Rollout rollout = world.rollout(held, {em::Wrench{{0, 0, -pull}, {0, 0, 0}}}, 1.0);
    const double height = em::unpack(scene, rollout.state).bodies.at("cube").position.z();
    std::printf("%.2f of the limit: %s\n", share, 0.24 - height < 0.001 ? "held" : "lost");
  }
}

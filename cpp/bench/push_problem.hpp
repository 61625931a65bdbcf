#pragma once
// A pusher that moves towards a box on a table.

#include <string>

#include "energymargin/problem.hpp"

namespace energymargin {

inline Body moving(const std::string& name, const Shape& shape, double mass, const Vector3& position, Role role) {
  Body body;
  body.name = name;
  body.shape = shape;
  body.mass = mass;
  body.state.position = position;
  body.friction = 0.3;
  body.role = role;
  return body;
}

inline Problem push() {
  Scene scene;
  Body table;
  table.name = "table";
  table.shape = Plane{};
  table.friction = 0.3;
  scene.add_body(table);
  scene.add_body(moving("object", Box{{1.2, 0.4, 0.1}}, 1.0, {1.0, 0.4, 0.05}, Role::object));
  Body effector = moving("effector", Cylinder{0.1, 0.1}, 4.0, {1.0, 0.1, 0.05}, Role::effector);
  effector.state.velocity = {0.0, 0.4, 0.0};
  scene.add_body(effector);
  Problem problem(scene, pack(scene), regions::Disc{"object", {1.0, 0.4}, 0.3});
  problem.force = {0.8, 0.8, 0.0};
  problem.torque = {0.0, 0.0, 0.05};
  problem.effector = Effector::drive;
  return problem;
}

}  // namespace energymargin

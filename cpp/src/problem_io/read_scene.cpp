// Scenes from JSON.

#include "problem_io/names.hpp"
#include "problem_io/read.hpp"

namespace energymargin::problem_io {
namespace {

Inertial read_inertial(const Place& place) {
  place.only({"center", "moments", "axes"});
  return {place["center"].vector3(), place["moments"].vector3(), place["axes"].quaternion()};
}

Body read_body(const Place& place, const std::string& folder) {
  place.only({"name", "shape", "mass", "position", "orientation", "velocity", "angular_velocity", "friction", "role",
              "linear_factor", "angular_factor", "force", "inertial"});
  Body body;
  body.name = place["name"].word();
  body.shape = read_shape(place["shape"], folder);
  body.mass = place["mass"].number();
  body.state = {place["position"].vector3(), place["orientation"].quaternion(), place["velocity"].vector3(),
                place["angular_velocity"].vector3()};
  body.friction = place["friction"].number();
  body.role = place["role"].one_of(roles);
  body.linear_factor = place["linear_factor"].vector3();
  body.angular_factor = place["angular_factor"].vector3();
  if (place.has("force")) body.force = place["force"].vector3();
  if (place.has("inertial")) body.inertial = read_inertial(place["inertial"]);
  return body;
}

Pose read_pose(const Place& place) {
  place.only({"position", "orientation"});
  return {place["position"].vector3(), place["orientation"].quaternion()};
}

Mimic read_mimic(const Place& place) {
  place.only({"joint", "multiplier", "offset"});
  return {place["joint"].word(), place["multiplier"].number(), place["offset"].number()};
}

Joint read_joint(const Place& place, const Scene& scene) {
  place.only({"name", "type", "parent", "child", "in_parent", "in_child", "axis", "lower", "upper", "position",
              "velocity", "held", "target", "target_velocity", "stiffness", "damping", "torque_limit", "mimic"});
  Joint joint;
  joint.name = place["name"].word();
  joint.type = place["type"].one_of(joint_types);
  joint.parent = read_body_name(place["parent"], scene);
  joint.child = read_body_name(place["child"], scene);
  joint.in_parent = read_pose(place["in_parent"]);
  joint.in_child = read_pose(place["in_child"]);
  joint.axis = place["axis"].vector3();
  joint.lower = place["lower"].size();
  joint.upper = place["upper"].size();
  joint.state = {place["position"].number(), place["velocity"].number()};
  joint.held = place["held"].truth();
  joint.target = place["target"].number();
  joint.target_velocity = place["target_velocity"].number();
  joint.stiffness = place["stiffness"].number();
  joint.damping = place["damping"].number();
  joint.torque_limit = place["torque_limit"].size();
  if (place.has("mimic")) joint.mimic = read_mimic(place["mimic"]);
  return joint;
}

Spring read_spring(const Place& place, const Scene& scene) {
  place.only({"body_a", "body_b", "point_a", "point_b", "stiffness", "rest_length", "damping"});
  return {read_body_name(place["body_a"], scene),
          read_body_name(place["body_b"], scene),
          place["point_a"].vector3(),
          place["point_b"].vector3(),
          place["stiffness"].number(),
          place["rest_length"].number(),
          place["damping"].number()};
}

void read_disabled_collision(const Place& pair, Scene& scene) {
  const std::vector<Place> names = pair.items();
  if (names.size() != 2) pair.fail("a list of two bodies");
  scene.disable_collisions(read_body_name(names[0], scene), read_body_name(names[1], scene));
}

Stepping read_stepping(const Place& place, int version) {
  Stepping stepping;
  stepping.step = place["step"].number();
  stepping.iterations = place["solver_iterations"].integer();
  stepping.tolerance = place["solver_tolerance"].number();
  // Files of version 1 come from simulations with one.
  if (version == 1) stepping.friction_directions = 1;
  if (place.has("friction_directions")) stepping.friction_directions = place["friction_directions"].integer();
  if (place.has("margin")) stepping.margin = place["margin"].number();
  return stepping;
}

}  // namespace

std::string read_body_name(const Place& place, const Scene& scene) {
  const std::string name = place.word();
  std::string known;
  for (const Body& body : scene.bodies()) {
    if (body.name == name) return name;
    known += (known.empty() ? "'" : ", '") + body.name + "'";
  }
  place.fail("one of the bodies " + known);
}

Scene read_scene(const Place& place, int version, const std::string& folder) {
  place.only({"gravity", "step", "solver_iterations", "solver_tolerance", "friction_directions", "margin", "bodies",
              "joints", "springs", "disabled_collisions"});
  Scene scene =
      located(place, [&](const Place& at) { return Scene(at["gravity"].vector3(), read_stepping(at, version)); });
  const std::vector<Place> bodies = place["bodies"].items();
  if (bodies.empty()) place["bodies"].fail("a list of at least one body");
  add_each(place, "bodies", [&](const Place& body) { scene.add_body(read_body(body, folder)); });
  add_each(place, "joints", [&](const Place& joint) { scene.add_joint(read_joint(joint, scene)); });
  add_each(place, "springs", [&](const Place& spring) { scene.add_spring(read_spring(spring, scene)); });
  add_each(place, "disabled_collisions", [&](const Place& pair) { read_disabled_collision(pair, scene); });
  return scene;
}

}  // namespace energymargin::problem_io

// A Problem from JSON.

#include "energymargin/problem_io.hpp"
#include "json.hpp"
#include "names.hpp"
#include "place.hpp"

namespace energymargin::problem_io {
namespace {

constexpr const char* solids = "\"box\", \"sphere\", \"cylinder\", \"capsule\" or \"convex_hull\"";

Solid read_solid(const Place& place) {
  const std::string type = place["type"].word();
  if (type == "box") {
    place.only({"type", "size"});
    return Box{place["size"].vector3()};
  }
  if (type == "sphere") {
    place.only({"type", "radius"});
    return Sphere{place["radius"].number()};
  }
  if (type == "cylinder" || type == "capsule") {
    place.only({"type", "radius", "length"});
    const double radius = place["radius"].number();
    const double length = place["length"].number();
    return type == "cylinder" ? Solid(Cylinder{radius, length}) : Solid(Capsule{radius, length});
  }
  if (type == "convex_hull") {
    place.only({"type", "points"});
    ConvexHull hull;
    for (const Place& point : place["points"].items()) hull.points.push_back(point.vector3());
    return hull;
  }
  place["type"].fail(solids);
}

MassProperties read_mass_properties(const Place& place) {
  place.only({"volume", "center", "moments", "axes"});
  return {place["volume"].number(), place["center"].vector3(), place["moments"].vector3(), place["axes"].quaternion()};
}

Compound read_compound(const Place& place) {
  place.only({"type", "parts", "solid"});
  Compound compound;
  for (const Place& part : place["parts"].items()) {
    part.only({"shape", "position", "orientation"});
    compound.parts.push_back(
        {read_solid(part["shape"]), {part["position"].vector3(), part["orientation"].quaternion()}});
  }
  if (place.has("solid")) compound.solid = read_mass_properties(place["solid"]);
  return compound;
}

Shape read_shape(const Place& place) {
  const std::string type = place["type"].word();
  if (type == "plane") {
    place.only({"type", "normal", "offset"});
    return Plane{place["normal"].vector3(), place["offset"].number()};
  }
  if (type == "compound") return read_compound(place);
  if (type != "box" && type != "sphere" && type != "cylinder" && type != "capsule" && type != "convex_hull") {
    place["type"].fail(std::string("\"plane\", \"compound\", ") + solids);
  }
  return std::visit([](auto&& solid) { return Shape(std::move(solid)); }, read_solid(place));
}

Body read_body(const Place& place) {
  place.only({"name", "shape", "mass", "position", "orientation", "velocity", "angular_velocity", "friction", "role",
              "linear_factor", "angular_factor", "force", "inertial"});
  Body body;
  body.name = place["name"].word();
  body.shape = read_shape(place["shape"]);
  body.mass = place["mass"].number();
  body.state = {place["position"].vector3(), place["orientation"].quaternion(), place["velocity"].vector3(),
                place["angular_velocity"].vector3()};
  body.friction = place["friction"].number();
  body.role = place["role"].one_of(roles);
  body.linear_factor = place["linear_factor"].vector3();
  body.angular_factor = place["angular_factor"].vector3();
  if (place.has("force")) body.force = place["force"].vector3();
  if (place.has("inertial")) {
    const Place inertial = place["inertial"];
    inertial.only({"center", "moments", "axes"});
    body.inertial =
        Inertial{inertial["center"].vector3(), inertial["moments"].vector3(), inertial["axes"].quaternion()};
  }
  return body;
}

Pose read_pose(const Place& place) {
  place.only({"position", "orientation"});
  return {place["position"].vector3(), place["orientation"].quaternion()};
}

Joint read_joint(const Place& place) {
  place.only({"name", "type", "parent", "child", "in_parent", "in_child", "axis", "lower", "upper", "position",
              "velocity", "held", "target", "target_velocity", "stiffness", "damping", "torque_limit", "mimic"});
  Joint joint;
  joint.name = place["name"].word();
  joint.type = place["type"].one_of(joint_types);
  joint.parent = place["parent"].word();
  joint.child = place["child"].word();
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
  if (place.has("mimic")) {
    const Place mimic = place["mimic"];
    mimic.only({"joint", "multiplier", "offset"});
    joint.mimic = Mimic{mimic["joint"].word(), mimic["multiplier"].number(), mimic["offset"].number()};
  }
  return joint;
}

Spring read_spring(const Place& place) {
  place.only({"body_a", "body_b", "point_a", "point_b", "stiffness", "rest_length", "damping"});
  return {place["body_a"].word(),     place["body_b"].word(),      place["point_a"].vector3(),
          place["point_b"].vector3(), place["stiffness"].number(), place["rest_length"].number(),
          place["damping"].number()};
}

ForceWeights read_force_weights(const Place& place) {
  place.only({"engage", "stick", "distance", "ground_engage", "ground_stick"});
  return {place["engage"].number(), place["stick"].number(), place["distance"].number(),
          place["ground_engage"].number(), place["ground_stick"].number()};
}

// Reads each item of a list and adds it; an error says where.
template <typename Add>
void add_each(const Place& list, const Add& add) {
  for (const Place& item : list.items()) {
    try {
      add(item);
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      throw std::invalid_argument(what.rfind(item.path(), 0) == 0 ? what : item.path() + ": " + what);
    }
  }
}

Scene read_scene(const Place& place) {
  place.only({"gravity", "step", "solver_iterations", "solver_tolerance", "friction_directions", "margin", "bodies",
              "joints", "springs", "disabled_collisions"});
  Stepping stepping;
  stepping.step = place["step"].number();
  stepping.iterations = place["solver_iterations"].integer();
  stepping.tolerance = place["solver_tolerance"].number();
  // Files of version 1 come from simulations with one.
  stepping.friction_directions = place.has("friction_directions") ? place["friction_directions"].integer() : 1;
  if (place.has("margin")) stepping.margin = place["margin"].number();
  Scene scene(place["gravity"].vector3(), stepping);
  add_each(place["bodies"], [&](const Place& body) { scene.add_body(read_body(body)); });
  if (place.has("joints")) add_each(place["joints"], [&](const Place& joint) { scene.add_joint(read_joint(joint)); });
  if (place.has("springs")) {
    add_each(place["springs"], [&](const Place& spring) { scene.add_spring(read_spring(spring)); });
  }
  if (place.has("disabled_collisions")) {
    add_each(place["disabled_collisions"], [&](const Place& pair) {
      const std::vector<Place> names = pair.items();
      if (names.size() != 2) pair.fail("a list of two bodies");
      scene.disable_collisions(names[0].word(), names[1].word());
    });
  }
  return scene;
}

regions::Swept read_swept(const Place& place) {
  place.only({"type", "body", "by", "half_width", "behind", "ahead", "least_speed", "disc_radius", "at"});
  regions::Swept swept;
  swept.body = place["body"].word();
  swept.by = place["by"].word();
  swept.half_width = place["half_width"].number();
  swept.behind = place["behind"].number();
  swept.ahead = place["ahead"].number();
  swept.least_speed = place["least_speed"].number();
  swept.disc_radius = place["disc_radius"].number();
  if (place.has("at")) {
    const Place at = place["at"];
    at.only({"position", "velocity", "yaw_rate"});
    swept.at = regions::PlanarMotion{at["position"].vector2(), at["velocity"].vector2(), at["yaw_rate"].number()};
  }
  return swept;
}

Region read_region(const Place& place, int depth = 0) {
  if (depth > most_levels) place.fail("at most " + std::to_string(most_levels) + " levels of \"and\", \"or\", \"not\"");
  const std::string type = place["type"].word();
  if (type == "and" || type == "or" || type == "not") {
    place.only({"type", "of"});
    std::vector<Region> of;
    for (const Place& item : place["of"].items()) of.push_back(read_region(item, depth + 1));
    if (of.empty() || (type == "not" && of.size() != 1)) {
      place["of"].fail(type == "not" ? "a list of one region" : "a list of at least one region");
    }
    if (type == "not") return regions::Complement{std::move(of)};
    return type == "and" ? Region(regions::Intersection{std::move(of)}) : Region(regions::Union{std::move(of)});
  }
  if (type == "swept") return read_swept(place);
  const std::string body = place["body"].word();
  const std::string frame = place.has("frame") ? place["frame"].word() : "";
  const auto only = [&place](std::vector<std::string> keys) {
    keys.insert(keys.end(), {"type", "body", "frame"});
    place.only(keys);
  };
  if (type == "ball") {
    only({"center", "radius"});
    return regions::Ball{body, place["center"].vector3(), place["radius"].number(), frame};
  }
  if (type == "box") {
    only({"center", "size"});
    const std::vector<Place> size = place["size"].items();
    if (size.size() != 3) place["size"].fail("a list of 3 numbers");
    return regions::Box{body, place["center"].vector3(), {size[0].size(), size[1].size(), size[2].size()}, frame};
  }
  if (type == "disc") {
    only({"center", "radius"});
    return regions::Disc{body, place["center"].vector2(), place["radius"].number(), frame};
  }
  if (type == "annular_sector") {
    only({"center", "radius", "half_width", "start_angle", "sweep"});
    return regions::AnnularSector{body,
                                  place["center"].vector2(),
                                  place["radius"].number(),
                                  place["half_width"].number(),
                                  place["start_angle"].number(),
                                  place["sweep"].number(),
                                  frame};
  }
  if (type == "half_space") {
    only({"normal", "offset"});
    return regions::HalfSpace{body, place["normal"].vector3(), place["offset"].number(), frame};
  }
  if (type == "speed") {
    only({"limit", "point"});
    return regions::Speed{body, place["limit"].number(), place["point"].vector3(), frame};
  }
  if (type == "tilt") {
    only({"axis", "reference", "limit"});
    return regions::Tilt{body, place["axis"].vector3(), place["reference"].vector3(), place["limit"].number(), frame};
  }
  place["type"].fail(
      "\"ball\", \"box\", \"disc\", \"annular_sector\", \"swept\", \"half_space\", \"speed\", \"tilt\", \"and\", "
      "\"or\" or \"not\"");
}

Region region_at(const Place& place) {
  try {
    return read_region(place);
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    throw std::invalid_argument(what.rfind(place.path(), 0) == 0 ? what : place.path() + ": " + what);
  }
}

Contact read_contact(const Place& place) {
  place.only({"body_a", "body_b", "position", "normal", "distance", "normal_force", "tangential_force", "friction"});
  return {place["body_a"].word(),
          place["body_b"].word(),
          place["position"].vector3(),
          place["normal"].vector3(),
          place["distance"].number(),
          place["normal_force"].number(),
          place["tangential_force"].vector3(),
          place["friction"].number()};
}

void check_header(const Place& place) {
  if (!place.has("format") || place["format"].word() != format_name) {
    throw std::invalid_argument("it has no \"format\": \"" + std::string(format_name) + "\", so it is no problem file");
  }
  const int version = place["version"].integer();
  if (version < 1 || version > problem_format_version) {
    place["version"].fail("at most " + std::to_string(problem_format_version) +
                          "; a newer energymargin wrote this file");
  }
}

}  // namespace

Problem read_problem(const Json& json) {
  const Place place(json, "problem");
  check_header(place);
  place.only({"format", "version", "scene", "state", "force", "torque", "duration", "captured", "succeeded", "within",
              "effector", "rate", "force_weights", "contacts", "captured_any", "succeeded_any"});
  const std::vector<Place> numbers = place["state"].items();
  State state(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) state[static_cast<Eigen::Index>(i)] = numbers[i].number();
  Problem problem{read_scene(place["scene"]), state,
                  place["force"].vector3(),   place["torque"].vector3(),
                  place["duration"].number(), region_at(place["captured"])};
  if (place.has("succeeded")) problem.succeeded = region_at(place["succeeded"]);
  if (place.has("within")) problem.within = region_at(place["within"]);
  if (place.has("captured_any")) problem.captured_any = region_at(place["captured_any"]);
  if (place.has("succeeded_any")) problem.succeeded_any = region_at(place["succeeded_any"]);
  problem.effector = place["effector"].one_of(effectors);
  problem.rate = place["rate"].number();
  if (place.has("force_weights")) problem.force_weights = read_force_weights(place["force_weights"]);
  if (place.has("contacts")) {
    problem.contacts.emplace();
    for (const Place& contact : place["contacts"].items()) problem.contacts->push_back(read_contact(contact));
  }
  return problem;
}

}  // namespace energymargin::problem_io

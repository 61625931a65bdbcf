#include "energymargin/problem_io.hpp"

#include <cstdio>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "check.hpp"

namespace energymargin {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format_name = "energymargin-problem";

// ---- writing

Json write(const Vector2& v) { return {v.x(), v.y()}; }
Json write(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Json write(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

// JSON has no infinity; a size without limit is the word.
Json write_size(double value) { return std::isinf(value) ? Json("inf") : Json(value); }

struct ShapeWriter {
  Json operator()(const Plane& s) const {
    return {{"type", "plane"}, {"normal", write(s.normal)}, {"offset", s.offset}};
  }
  Json operator()(const Box& s) const { return {{"type", "box"}, {"size", write(s.size)}}; }
  Json operator()(const Sphere& s) const { return {{"type", "sphere"}, {"radius", s.radius}}; }
  Json operator()(const Cylinder& s) const {
    return {{"type", "cylinder"}, {"radius", s.radius}, {"length", s.length}};
  }
  Json operator()(const Capsule& s) const { return {{"type", "capsule"}, {"radius", s.radius}, {"length", s.length}}; }
  Json operator()(const ConvexHull& s) const {
    Json points = Json::array();
    for (const Vector3& point : s.points) points.push_back(write(point));
    return {{"type", "convex_hull"}, {"points", points}};
  }
};

struct RegionWriter {
  Json write_region(const Region& region) const { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  Json with_body(const char* type, const Primitive& primitive, Json more) const {
    Json json = {{"type", type}, {"body", primitive.body}};
    json.update(more);
    if (!primitive.frame.empty()) json["frame"] = primitive.frame;
    return json;
  }
  Json list(const char* type, const std::vector<Region>& of) const {
    Json json = {{"type", type}, {"of", Json::array()}};
    for (const Region& region : of) json["of"].push_back(write_region(region));
    return json;
  }

  Json operator()(const regions::Ball& r) const {
    return with_body("ball", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  Json operator()(const regions::Box& r) const {
    const Json size = {write_size(r.size.x()), write_size(r.size.y()), write_size(r.size.z())};
    return with_body("box", r, {{"center", write(r.center)}, {"size", size}});
  }
  Json operator()(const regions::Disc& r) const {
    return with_body("disc", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  Json operator()(const regions::AnnularSector& r) const {
    return with_body("annular_sector", r,
                     {{"center", write(r.center)},
                      {"radius", r.radius},
                      {"half_width", r.half_width},
                      {"start_angle", r.start_angle},
                      {"sweep", r.sweep}});
  }
  Json operator()(const regions::Swept& r) const {
    Json json = {{"type", "swept"},
                 {"body", r.body},
                 {"by", r.by},
                 {"half_width", r.half_width},
                 {"behind", r.behind},
                 {"ahead", r.ahead},
                 {"least_speed", r.least_speed},
                 {"disc_radius", r.disc_radius}};
    if (r.at) {
      json["at"] = {
          {"position", write(r.at->position)}, {"velocity", write(r.at->velocity)}, {"yaw_rate", r.at->yaw_rate}};
    }
    return json;
  }
  Json operator()(const regions::HalfSpace& r) const {
    return with_body("half_space", r, {{"normal", write(r.normal)}, {"offset", r.offset}});
  }
  Json operator()(const regions::Speed& r) const {
    return with_body("speed", r, {{"limit", r.limit}, {"point", write(r.point)}});
  }
  Json operator()(const regions::Tilt& r) const {
    return with_body("tilt", r, {{"axis", write(r.axis)}, {"reference", write(r.reference)}, {"limit", r.limit}});
  }
  Json operator()(const regions::Predicate&) const {
    throw std::invalid_argument("a region made of a Predicate has no file format; build it from em.regions");
  }
  Json operator()(const regions::Intersection& r) const { return list("and", r.of); }
  Json operator()(const regions::Union& r) const { return list("or", r.of); }
  Json operator()(const regions::Complement& r) const { return list("not", r.of); }
};

Json write(const Region& region) { return RegionWriter{}.write_region(region); }

const std::vector<std::pair<const char*, Role>> roles{
    {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
const std::vector<std::pair<const char*, Effector>> effectors{{"coast", Effector::coast}, {"drive", Effector::drive}};

template <typename Value>
const char* name_of(const std::vector<std::pair<const char*, Value>>& names, Value value) {
  for (const auto& [name, named] : names) {
    if (named == value) return name;
  }
  throw std::logic_error("a value without a name");
}

Json write(const Body& body) {
  return {{"name", body.name},
          {"shape", std::visit(ShapeWriter{}, body.shape)},
          {"mass", body.mass},
          {"position", write(body.state.position)},
          {"orientation", write(body.state.orientation)},
          {"velocity", write(body.state.velocity)},
          {"angular_velocity", write(body.state.angular_velocity)},
          {"friction", body.friction},
          {"role", name_of(roles, body.role)},
          {"linear_factor", write(body.linear_factor)},
          {"angular_factor", write(body.angular_factor)}};
}

Json write(const Scene& scene) {
  const Stepping& stepping = scene.stepping();
  Json json = {{"gravity", write(scene.gravity())},
               {"step", stepping.step},
               {"solver_iterations", stepping.iterations},
               {"solver_tolerance", stepping.tolerance}};
  if (stepping.margin) json["margin"] = *stepping.margin;
  json["bodies"] = Json::array();
  for (const Body& body : scene.bodies()) json["bodies"].push_back(write(body));
  return json;
}

Json write(const Contact& contact) {
  return {{"body_a", contact.body_a},
          {"body_b", contact.body_b},
          {"position", write(contact.position)},
          {"normal", write(contact.normal)},
          {"distance", contact.distance},
          {"normal_force", contact.normal_force},
          {"tangential_force", write(contact.tangential_force)},
          {"friction", contact.friction}};
}

// ---- reading

// A place in the file, for error messages: "scene.bodies[1].mass".
class Place {
 public:
  Place(const Json& json, std::string path) : json_(json), path_(std::move(path)) {}

  const std::string& path() const { return path_; }

  [[noreturn]] void fail(const std::string& expected) const {
    std::string found = json_.dump();
    if (found.size() > 60) found = found.substr(0, 57) + "...";
    throw std::invalid_argument(path_ + " is " + found + ", expected " + expected);
  }

  bool has(const std::string& key) const { return object().contains(key); }

  Place operator[](const std::string& key) const {
    if (!has(key)) throw std::invalid_argument(path_ + " has no \"" + key + "\"");
    return {json_.at(key), path_ == "problem" ? key : path_ + "." + key};
  }

  //! Rejects keys that nobody reads: a misspelt setting must not pass in silence.
  void only(const std::vector<std::string>& keys) const {
    for (const auto& [key, value] : object().items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        std::string known;
        for (const std::string& name : keys) known += (known.empty() ? "" : ", ") + name;
        throw std::invalid_argument(path_ + " has an unknown \"" + key + "\", expected only " + known);
      }
    }
  }

  double number() const {
    if (!json_.is_number()) fail("a number");
    return json_.get<double>();
  }
  double size() const {
    if (json_.is_string() && json_.get<std::string>() == "inf") return std::numeric_limits<double>::infinity();
    if (!json_.is_number()) fail("a number or \"inf\"");
    return json_.get<double>();
  }
  int integer() const {
    if (!json_.is_number_integer()) fail("a whole number");
    const auto value = json_.get<std::int64_t>();
    if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max()) fail("a smaller number");
    return static_cast<int>(value);
  }
  std::string word() const {
    if (!json_.is_string()) fail("a text");
    return json_.get<std::string>();
  }
  std::vector<Place> items() const {
    if (!json_.is_array()) fail("a list");
    std::vector<Place> places;
    for (std::size_t i = 0; i < json_.size(); ++i) places.emplace_back(json_[i], path_ + "[" + std::to_string(i) + "]");
    return places;
  }
  std::vector<double> numbers(std::size_t count) const {
    const std::vector<Place> places = items();
    if (places.size() != count) fail("a list of " + std::to_string(count) + " numbers");
    std::vector<double> values;
    for (const Place& place : places) values.push_back(place.number());
    return values;
  }
  Vector2 vector2() const {
    const auto v = numbers(2);
    return {v[0], v[1]};
  }
  Vector3 vector3() const {
    const auto v = numbers(3);
    return {v[0], v[1], v[2]};
  }
  Quaternion quaternion() const {
    const auto v = numbers(4);
    return {v[3], v[0], v[1], v[2]};
  }
  template <typename Value>
  Value one_of(const std::vector<std::pair<const char*, Value>>& names) const {
    std::string known;
    for (const auto& [name, value] : names) {
      if (word() == name) return value;
      known += (known.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    }
    fail("one of " + known);
  }

 private:
  const Json& object() const {
    if (!json_.is_object()) fail("an object { }");
    return json_;
  }

  const Json& json_;
  std::string path_;
};

Shape read_shape(const Place& place) {
  const std::string type = place["type"].word();
  if (type == "plane") {
    place.only({"type", "normal", "offset"});
    return Plane{place["normal"].vector3(), place["offset"].number()};
  }
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
    return type == "cylinder" ? Shape(Cylinder{radius, length}) : Shape(Capsule{radius, length});
  }
  if (type == "convex_hull") {
    place.only({"type", "points"});
    ConvexHull hull;
    for (const Place& point : place["points"].items()) hull.points.push_back(point.vector3());
    return hull;
  }
  place["type"].fail("\"plane\", \"box\", \"sphere\", \"cylinder\", \"capsule\" or \"convex_hull\"");
}

Body read_body(const Place& place) {
  place.only({"name", "shape", "mass", "position", "orientation", "velocity", "angular_velocity", "friction", "role",
              "linear_factor", "angular_factor"});
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
  return body;
}

Scene read_scene(const Place& place) {
  place.only({"gravity", "step", "solver_iterations", "solver_tolerance", "margin", "bodies"});
  Stepping stepping;
  stepping.step = place["step"].number();
  stepping.iterations = place["solver_iterations"].integer();
  stepping.tolerance = place["solver_tolerance"].number();
  if (place.has("margin")) stepping.margin = place["margin"].number();
  Scene scene(place["gravity"].vector3(), stepping);
  for (const Place& body : place["bodies"].items()) {
    try {
      scene.add_body(read_body(body));
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      throw std::invalid_argument(what.rfind(body.path(), 0) == 0 ? what : body.path() + ": " + what);
    }
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
  if (depth > 64) place.fail("at most 64 levels of \"and\", \"or\", \"not\"");
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

Problem read_problem(const Place& place) {
  check_header(place);
  place.only({"format", "version", "scene", "state", "force", "torque", "duration", "captured", "succeeded", "within",
              "effector", "rate", "contacts"});
  const std::vector<Place> numbers = place["state"].items();
  State state(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) state[static_cast<Eigen::Index>(i)] = numbers[i].number();
  Problem problem{read_scene(place["scene"]), state,
                  place["force"].vector3(),   place["torque"].vector3(),
                  place["duration"].number(), region_at(place["captured"])};
  if (place.has("succeeded")) problem.succeeded = region_at(place["succeeded"]);
  if (place.has("within")) problem.within = region_at(place["within"]);
  problem.effector = place["effector"].one_of(effectors);
  problem.rate = place["rate"].number();
  if (place.has("contacts")) {
    problem.contacts.emplace();
    for (const Place& contact : place["contacts"].items()) problem.contacts->push_back(read_contact(contact));
  }
  return problem;
}

}  // namespace

std::string to_json(const Problem& problem) {
  validate(problem);
  Json json = {{"format", format_name}, {"version", problem_format_version}};
  json["scene"] = write(problem.scene);
  json["state"] = std::vector<double>(problem.state.begin(), problem.state.end());
  json["force"] = write(problem.force);
  json["torque"] = write(problem.torque);
  json["duration"] = problem.duration;
  json["captured"] = write(problem.captured);
  if (problem.succeeded) json["succeeded"] = write(*problem.succeeded);
  if (problem.within) json["within"] = write(*problem.within);
  json["effector"] = name_of(effectors, problem.effector);
  json["rate"] = problem.rate;
  if (problem.contacts) {
    json["contacts"] = Json::array();
    for (const Contact& contact : *problem.contacts) json["contacts"].push_back(write(contact));
  }
  return json.dump(1) + "\n";
}

Problem from_json(const std::string& text) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw std::invalid_argument("not valid JSON, or cut off, at byte " + std::to_string(error.byte) + " of " +
                                std::to_string(text.size()));
  }
  Problem problem = read_problem(Place(json, "problem"));
  validate(problem);
  return problem;
}

void save(const Problem& problem, const std::string& path) {
  const std::string text = to_json(problem);
  const std::string partial = path + ".part";
  {
    std::ofstream file(partial, std::ios::binary);
    file << text << std::flush;
    if (!file) {
      std::remove(partial.c_str());
      throw std::runtime_error("cannot write '" + path + "'");
    }
  }
  if (std::rename(partial.c_str(), path.c_str()) != 0) {
    std::remove(partial.c_str());
    throw std::runtime_error("cannot write '" + path + "'");
  }
}

Problem load(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file || text.str().empty())
    throw std::invalid_argument("problem file '" + path + "' cannot be read or is empty");
  try {
    return from_json(text.str());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("problem file '" + path + "': " + error.what());
  }
}

}  // namespace energymargin

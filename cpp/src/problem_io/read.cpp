// A Problem from JSON.

#include "energymargin/problem_io.hpp"
#include "problem/records.hpp"
#include "problem_io/records.hpp"

namespace energymargin::problem_io {
namespace {

constexpr int version_with_clock = 4;
constexpr int version_with_friction_rule = 5;
constexpr int version_with_newton_solver = 6;

int read_version(const JsonNode& node) {
  if (!node.has("format") || node["format"].text() != format_name) {
    throw std::invalid_argument("it has no \"format\": \"" + std::string(format_name) + "\", so it is no problem file");
  }
  const int version = node["version"].integer();
  if (version > problem_format_version) {
    node["version"].fail("at most " + std::to_string(problem_format_version) +
                         "; a newer energymargin wrote this file");
  }
  if (version < oldest_problem_format_version) {
    node["version"].fail("a whole number from " + std::to_string(oldest_problem_format_version) + " to " +
                         std::to_string(problem_format_version));
  }
  return version;
}

// Throws std::invalid_argument if a file of `version` has a key that there is only `since` a later one.
void require_version(const JsonNode& node, const std::vector<std::string>& keys, int since, int version) {
  for (const std::string& key : keys) {
    if (version >= since || !node.has(key)) continue;
    throw std::invalid_argument(node.path() + " has \"" + key + "\", expected only from \"version\": " +
                                std::to_string(since) + " on; this file says " + std::to_string(version));
  }
}

// The older solver counted sweeps over the contacts and stopped below a squared change of speed [m^2/s^2]. Neither
// number says anything about Newton iterations and a relative residual: the defaults take their place.
Stepping read_stepping(const JsonNode& node, int version) {
  Stepping stepping;
  stepping.step = node["step"].number();
  if (version >= version_with_newton_solver) {
    stepping.iterations = node["solver_iterations"].integer();
    stepping.tolerance = node["solver_tolerance"].number();
  } else {
    for (const char* key : {"solver_iterations", "solver_tolerance"}) node[key].number();
  }
  if (node.has("margin")) stepping.margin = node["margin"].number();
  if (node.has("engine") && !node["engine"].is_text()) {
    node["engine"].fail(
        "\"native\" or \"bullet\": a file does not hold an engine of Python, which goes on with "
        "problem.with_engine(engine)");
  }
  if (node.has("engine")) stepping.engine = node["engine"].one_of<EngineKind>();
  return stepping;
}

// Since version 6 friction always acts in every direction of the contact plane, as it did with two directions.
void read_friction_directions(const JsonNode& node, std::vector<Warning>* warnings) {
  const int directions = node.integer();
  if (directions != 1 && directions != 2) node.fail("1 or 2");
  if (directions == 2 || !warnings) return;
  warnings->push_back({"scene: friction_directions",
                       "the file has \"friction_directions\": 1, which there is no more: friction now acts in every "
                       "direction of the contact plane, so that scores may differ from those of version 0.13"});
}

Scene read_scene(const JsonNode& node, int version, const std::string& folder, std::vector<Warning>* warnings) {
  std::vector<std::string> keys{
      "gravity", "step",   "solver_iterations", "solver_tolerance",    "margin",         "friction_rule", "engine",
      "bodies",  "joints", "springs",           "disabled_collisions", "pair_frictions", "tendons",       "loops"};
  if (version < version_with_newton_solver) keys.emplace_back("friction_directions");
  node.allow_keys(keys);
  if (node.has("friction_directions")) read_friction_directions(node["friction_directions"], warnings);
  require_version(node, {"friction_rule", "pair_frictions"}, version_with_friction_rule, version);
  Scene scene = with_path(node, [&](const JsonNode& at) {
    return Scene(Vector3(at["gravity"].vector<3>()), read_stepping(at, version),
                 at.has("friction_rule") ? at["friction_rule"].one_of<FrictionRule>() : FrictionRule::product);
  });
  if (node["bodies"].items().empty()) node["bodies"].fail("a list of at least one body");
  const RecordReader records(&scene, folder);
  for_each_item(node, "bodies", [&](const JsonNode& body) {
    require_version(body, {"kinematic"}, version_with_friction_rule, version);
    require_version(body, {"surface", "surface_velocity"}, version_with_newton_solver, version);
    scene.add_body(records.record<Body>(body));
  });
  for_each_item(node, "joints", [&](const JsonNode& joint) {
    require_version(joint, {"armature"}, version_with_friction_rule, version);
    require_version(joint, {"friction"}, version_with_newton_solver, version);
    scene.add_joint(records.record<Joint>(joint));
  });
  require_version(node, {"tendons", "loops"}, version_with_newton_solver, version);
  for_each_item(node, "tendons", [&](const JsonNode& tendon) { scene.add_tendon(records.record<Tendon>(tendon)); });
  for_each_item(node, "loops", [&](const JsonNode& loop) { scene.add_loop(records.record<Loop>(loop)); });
  for_each_item(node, "springs", [&](const JsonNode& spring) { scene.add_spring(records.record<Spring>(spring)); });
  for_each_item(node, "disabled_collisions", [&](const JsonNode& pair) {
    const std::vector<JsonNode> names = pair.items();
    if (names.size() != 2) pair.fail("a list of two bodies");
    scene.disable_collisions(read_body_name(names[0], scene), read_body_name(names[1], scene));
  });
  for_each_item(node, "pair_frictions",
                [&](const JsonNode& item) { scene.set_friction(records.record<PairFriction>(item)); });
  return scene;
}

}  // namespace

Problem read_problem(const Json& json, const std::string& folder, std::vector<Warning>* warnings,
                     const Policies& policies) {
  const JsonNode node(json, "problem");
  const int version = read_version(node);
  if (node.has("$schema")) node["$schema"].text();
  Problem problem = initial<Problem>();
  problem.scene = read_scene(node["scene"], version, folder, warnings);
  const std::vector<double> state = node["state"].all_numbers();
  problem.state = Eigen::Map<const State>(state.data(), static_cast<Eigen::Index>(state.size()));
  require_version(node, {"horizon", "check", "dwell", "plan"}, version_with_clock, version);
  RecordReader(&problem.scene, "", policies)
      .read_fields(node, problem, {"$schema", "format", "version", "scene", "state"});
  return problem;
}

}  // namespace energymargin::problem_io

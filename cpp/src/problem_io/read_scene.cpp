// Scenes from JSON.

#include "problem_io/format.hpp"
#include "problem_io/read_record.hpp"
#include "scene/records.hpp"
#include "scene/words.hpp"

namespace energymargin::problem_io {
namespace {

void read_disabled_collision(const JsonNode& pair, Scene& scene) {
  const std::vector<JsonNode> names = pair.items();
  if (names.size() != 2) pair.fail("a list of two bodies");
  scene.disable_collisions(read_body_name(names[0], scene), read_body_name(names[1], scene));
}

void read_pair_friction(const PairFriction& pair, Scene& scene) {
  scene.set_friction(pair.body_a, pair.body_b, pair.friction);
}

FrictionRule read_friction_rule(const JsonNode& node) {
  return node.has("friction_rule") ? node["friction_rule"].one_of<FrictionRule>() : FrictionRule::product;
}

Stepping read_stepping(const JsonNode& node) {
  Stepping stepping;
  stepping.step = node["step"].number();
  stepping.iterations = node["solver_iterations"].integer();
  stepping.tolerance = node["solver_tolerance"].number();
  if (node.has("margin")) stepping.margin = node["margin"].number();
  return stepping;
}

}  // namespace

std::string read_body_name(const JsonNode& node, const Scene& scene) {
  const std::string name = node.text();
  std::string known;
  for (const Body& body : scene.bodies()) {
    if (body.name == name) return name;
    known += (known.empty() ? "'" : ", '") + body.name + "'";
  }
  node.fail("one of the bodies " + known);
}

Scene read_scene(const JsonNode& node, int version, const std::string& folder) {
  node.allow_keys({"gravity", "step", "solver_iterations", "solver_tolerance", "margin", "friction_rule", "bodies",
                   "joints", "springs", "disabled_collisions", "pair_frictions"});
  for (const char* key : {"friction_rule", "pair_frictions"}) {
    require_version(node, key, version_with_friction_rule, version);
  }
  Scene scene = with_path(node, [&](const JsonNode& at) {
    return Scene(at["gravity"].vector3(), read_stepping(at), read_friction_rule(at));
  });
  if (node["bodies"].items().empty()) node["bodies"].fail("a list of at least one body");
  const RecordReader records(&scene, folder);
  for_each_item(node, "bodies", [&](const JsonNode& body) {
    require_version(body, "kinematic", version_with_friction_rule, version);
    scene.add_body(records.record<Body>(body));
  });
  for_each_item(node, "joints", [&](const JsonNode& joint) {
    require_version(joint, "armature", version_with_friction_rule, version);
    scene.add_joint(records.record<Joint>(joint));
  });
  for_each_item(node, "springs", [&](const JsonNode& spring) { scene.add_spring(records.record<Spring>(spring)); });
  for_each_item(node, "disabled_collisions", [&](const JsonNode& pair) { read_disabled_collision(pair, scene); });
  for_each_item(node, "pair_frictions",
                [&](const JsonNode& pair) { read_pair_friction(records.record<PairFriction>(pair), scene); });
  return scene;
}

}  // namespace energymargin::problem_io

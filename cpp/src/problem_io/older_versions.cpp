#include "problem_io/older_versions.hpp"

#include "energymargin/problem_io.hpp"
#include "problem_io/format.hpp"
#include "problem_io/json_node.hpp"

namespace energymargin::problem_io {
namespace {

constexpr const char* directions_key = "friction_directions";

bool is_older(const Json& file) {
  if (!file.is_object() || !file.contains("version") || !file["version"].is_number_integer()) return false;
  const JsonNode version(file["version"], "version");
  return version.integer() >= oldest_problem_format_version && version.integer() < version_with_newton_solver;
}

void set_if_number(Json& scene, const char* key, const Json& value) {
  if (scene.contains(key) && scene[key].is_number()) scene[key] = value;
}

// Since version 6 friction always acts in every direction of the contact plane, as it did with two directions.
std::vector<Warning> drop_friction_directions(Json& scene) {
  const auto entry = scene.find(directions_key);
  if (entry == scene.end()) return {};
  const JsonNode node(*entry, "scene.friction_directions");
  const int directions = node.integer();
  if (directions != 1 && directions != 2) node.fail("1 or 2");
  scene.erase(entry);
  if (directions == 2) return {};
  return {
      {"scene: friction_directions",
       "the file has \"friction_directions\": 1, which there is no more: friction now acts in every direction of the "
       "contact plane, so that scores may differ from those of version 0.13"}};
}

}  // namespace

std::vector<Warning> update_scene(Json& file) {
  if (!is_older(file) || !file.contains("scene") || !file["scene"].is_object()) return {};
  Json& scene = file["scene"];
  // The solver of their time counted sweeps over the contacts and stopped below a squared change of speed [m^2/s^2].
  // Neither number says anything about Newton iterations and a relative residual, so the defaults take their place.
  set_if_number(scene, "solver_iterations", Stepping{}.iterations);
  set_if_number(scene, "solver_tolerance", Stepping{}.tolerance);
  return drop_friction_directions(scene);
}

}  // namespace energymargin::problem_io

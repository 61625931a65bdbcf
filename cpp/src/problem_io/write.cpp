// A Problem as JSON.

#include "energymargin/problem_io.hpp"
#include "problem/records.hpp"
#include "problem_io/mesh.hpp"
#include "problem_io/write_record.hpp"
#include "scene/records.hpp"
#include "sets/records.hpp"

namespace energymargin::problem_io {

OrderedJson write(const regions::Predicate&) {
  throw std::invalid_argument("a region made of a Predicate has no file format; build it from em.regions");
}

OrderedJson write(const Region& region) { return write(region.expression()); }

namespace {

OrderedJson write_body(const Body& body, const MeshFiles& meshes) {
  OrderedJson json = write_record(body);
  if (const auto mesh = meshes.find(body.name); mesh != meshes.end()) {
    json["shape"] = write_record(MeshShape{mesh->second, std::get<Compound>(body.shape).solid});
  }
  return json;
}

OrderedJson write_scene(const Scene& scene, const MeshFiles& meshes) {
  const Stepping& stepping = scene.stepping();
  OrderedJson json = {{"gravity", write(scene.gravity())},
                      {"step", stepping.step},
                      {"solver_iterations", stepping.iterations},
                      {"solver_tolerance", stepping.tolerance}};
  if (stepping.margin) json["margin"] = *stepping.margin;
  if (scene.friction_rule() != FrictionRule::product) json["friction_rule"] = word_of(scene.friction_rule());
  json["bodies"] = OrderedJson::array();
  for (const Body& body : scene.bodies()) json["bodies"].push_back(write_body(body, meshes));
  json["joints"] = write(scene.joints());
  json["springs"] = write(scene.springs());
  if (!scene.disabled_collisions().empty()) json["disabled_collisions"] = scene.disabled_collisions();
  if (!scene.pair_frictions().empty()) json["pair_frictions"] = write(scene.pair_frictions());
  return json;
}

}  // namespace

OrderedJson write_problem(const Problem& problem, const MeshFiles& meshes) {
  OrderedJson json = {{"format", format_name}, {"version", problem_format_version}};
  json["scene"] = write_scene(problem.scene, meshes);
  json["state"] = std::vector<double>(problem.state.begin(), problem.state.end());
  write_fields(problem, json);
  return json;
}

}  // namespace energymargin::problem_io

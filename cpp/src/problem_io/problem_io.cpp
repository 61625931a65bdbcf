#include "energymargin/problem_io.hpp"

#include <cctype>
#include <filesystem>
#include <map>
#include <set>

#include "problem/records.hpp"
#include "problem_io/files.hpp"
#include "problem_io/records.hpp"

namespace energymargin {

problem_io::OrderedJson problem_io::write(const regions::Predicate&) {
  throw std::invalid_argument("a region made of a Predicate has no file format; build it from em.regions");
}

problem_io::OrderedJson problem_io::write(const Region& region) { return write(region.expression()); }

namespace {

using problem_io::OrderedJson;
using problem_io::write;

// Files of the bodies whose compounds are not in the problem file itself, by the body's name.
using MeshFiles = std::map<std::string, std::string>;

OrderedJson write_body(const Body& body, const MeshFiles& meshes) {
  OrderedJson json = problem_io::write_record(body);
  if (const auto mesh = meshes.find(body.name); mesh != meshes.end()) {
    json["shape"] = problem_io::write_record(problem_io::MeshShape{mesh->second, std::get<Compound>(body.shape).solid});
  }
  return json;
}

OrderedJson write_scene(const Scene& scene, const MeshFiles& meshes) {
  const Stepping& stepping = scene.stepping();
  OrderedJson json = {{"gravity", write(scene.gravity())},
                      {"step", stepping.step},
                      {"solver_iterations", stepping.most_iterations()},
                      {"solver_tolerance", stepping.residual()}};
  if (stepping.margin) json["margin"] = *stepping.margin;
  if (scene.friction_rule() != FrictionRule::product) json["friction_rule"] = word_of(scene.friction_rule());
  if (stepping.engine != EngineKind::native) json["engine"] = word_of(stepping.engine);
  if (const auto& own = stepping.simulator) json["engine"] = {{"name", own->name}, {"digest", own->digest}};
  json["bodies"] = OrderedJson::array();
  for (const Body& body : scene.bodies()) json["bodies"].push_back(write_body(body, meshes));
  json["joints"] = write(scene.joints());
  if (!scene.tendons().empty()) json["tendons"] = write(scene.tendons());
  if (!scene.loops().empty()) json["loops"] = write(scene.loops());
  json["springs"] = write(scene.springs());
  if (!scene.disabled_collisions().empty()) json["disabled_collisions"] = scene.disabled_collisions();
  if (!scene.pair_frictions().empty()) json["pair_frictions"] = write(scene.pair_frictions());
  return json;
}

std::string text_of(const OrderedJson& json) {
  try {
    return json.dump(1) + "\n";
  } catch (const OrderedJson::type_error&) {
    throw std::invalid_argument("a body or joint has a name that is not valid UTF-8, and JSON knows nothing else");
  }
}

std::string json_text(const Problem& problem, const MeshFiles& meshes) {
  validate(problem);
  OrderedJson json = {{"format", problem_io::format_name}, {"version", problem_format_version}};
  json["scene"] = write_scene(problem.scene, meshes);
  json["state"] = std::vector<double>(problem.state.begin(), problem.state.end());
  problem_io::write_fields(problem, json);
  return text_of(json);
}

// "push-cup.obj" for the body "cup" of "push.json"; what a file's name does not bear becomes "_".
std::string mesh_file_name(const std::string& stem, const std::string& body, const std::set<std::string>& taken) {
  std::string name = stem + "-" + body.substr(0, 100);
  for (std::size_t i = stem.size(); i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    if (c >= 0x80 || (std::isalnum(c) == 0 && c != '-' && c != '_' && c != '.')) name[i] = '_';
  }
  std::string unique = name;
  for (int i = 2; taken.count(unique) != 0; ++i) unique = name + "-" + std::to_string(i);
  return unique;
}

// Each body whose shape can go into a file of its own, and that file's name.
MeshFiles mesh_files(const Scene& scene, const std::string& stem) {
  MeshFiles meshes;
  std::set<std::string> taken;
  for (const Body& body : scene.bodies()) {
    const auto* compound = std::get_if<Compound>(&body.shape);
    if (compound == nullptr || !problem_io::fits_mesh(*compound)) continue;
    const std::string name = mesh_file_name(stem, body.name, taken);
    taken.insert(name);
    meshes[body.name] = name + ".obj";
  }
  return meshes;
}

}  // namespace

std::string to_json(const Problem& problem) { return json_text(problem, {}); }

Problem from_json(const std::string& text, const std::string& folder, std::vector<Warning>* warnings,
                  const Policies& policies) {
  Problem problem = problem_io::read_problem(problem_io::parse(text), folder, warnings, policies);
  validate(problem);
  return problem;
}

std::string to_json(const Plan& plan) {
  validate(plan);
  return text_of(write(plan));
}

Plan plan_from_json(const std::string& text, const Policies& policies) {
  return problem_io::read_plan(problem_io::parse(text, "a plan"), policies);
}

void save(const Problem& problem, const std::string& path, Meshes meshes) {
  if (const auto& simulator = problem.scene.stepping().simulator) {
    reject("engine", "'" + simulator->name + "'", "'native' or 'bullet' in a file: problem.with_engine(...)");
  }
  const std::filesystem::path file = path;
  MeshFiles names;
  if (meshes == Meshes::files) names = mesh_files(problem.scene, file.stem().string());
  const std::string text = json_text(problem, names);
  std::vector<problem_io::File> files;
  for (const auto& [body, name] : names) {
    const auto& compound = std::get<Compound>(problem.scene.body(body).shape);
    files.push_back({(file.parent_path() / name).string(), problem_io::write_mesh(compound)});
  }
  files.push_back({path, text});
  problem_io::write_files(files);
}

Problem load(const std::string& path, std::vector<Warning>* warnings, const Policies& policies) {
  const std::string text = problem_io::read_file("problem file", path);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  return at_place("problem file '" + path + "': ",
                  [&] { return from_json(text, folder.empty() ? "." : folder.string(), warnings, policies); });
}

}  // namespace energymargin

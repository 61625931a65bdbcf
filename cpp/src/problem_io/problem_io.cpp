#include "energymargin/problem_io.hpp"

#include <cctype>
#include <filesystem>
#include <set>

#include "problem_io/files.hpp"
#include "problem_io/json.hpp"
#include "problem_io/mesh.hpp"

namespace energymargin {
namespace {

std::string text_of(const problem_io::OrderedJson& json) {
  try {
    return json.dump(1) + "\n";
  } catch (const problem_io::OrderedJson::type_error&) {
    throw std::invalid_argument("a body or joint has a name that is not valid UTF-8, and JSON knows nothing else");
  }
}

std::string json_text(const Problem& problem, const problem_io::MeshFiles& meshes) {
  validate(problem);
  return text_of(problem_io::write_problem(problem, meshes));
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
problem_io::MeshFiles mesh_files(const Scene& scene, const std::string& stem) {
  problem_io::MeshFiles meshes;
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

Problem from_json(const std::string& text, const std::string& folder, std::vector<Warning>* warnings) {
  Problem problem = problem_io::read_problem(problem_io::parse(text), folder, warnings);
  validate(problem);
  return problem;
}

std::string to_json(const Plan& plan) {
  validate(plan);
  return text_of(problem_io::write(plan));
}

Plan plan_from_json(const std::string& text) { return problem_io::read_plan(problem_io::parse(text, "a plan")); }

void save(const Problem& problem, const std::string& path, Meshes meshes) {
  const std::filesystem::path file = path;
  problem_io::MeshFiles names;
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

Problem load(const std::string& path, std::vector<Warning>* warnings) {
  const std::string text = problem_io::read_file("problem file", path);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  try {
    return from_json(text, folder.empty() ? "." : folder.string(), warnings);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("problem file '" + path + "': " + error.what());
  }
}

}  // namespace energymargin

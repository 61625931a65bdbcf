// Writes what fuzzing starts from, and nothing else, into a folder: fuzz_seeds FOLDER.

#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "problem_files.hpp"
#include "problem_io/json.hpp"
#include "problem_io/mesh.hpp"

namespace energymargin {
namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream(file, std::ios::binary);
  if (!(stream << text << std::flush)) throw FileError("cannot write '" + file.string() + "'");
}

std::string in_one_line(const Problem& problem) { return problem_io::OrderedJson::parse(to_json(problem)).dump(); }

Problem with_meshes() {
  Problem problem = scenes::drift();
  problem.scene.add_body(scenes::body("mug", scenes::mug(), 0.3, {2.0, 0.0, 0.0}));
  problem.state = pack(problem.scene);
  return problem;
}

// The same with its mesh in tests/fuzz/meshes.
std::string with_mesh_file() {
  auto json = problem_io::OrderedJson::parse(to_json(with_meshes()));
  json["scene"]["bodies"].back()["shape"] = {{"type", "mesh"}, {"file", "mug.obj"}};
  return json.dump();
}

// A pusher whose plan is short enough to be written as lists.
Problem held() {
  Problem problem = scenes::push(Effector::coast);
  problem.plan = hold(problem.scene, problem.state, 3.0 * problem.scene.stepping().step);
  return problem;
}

// As version 0.13 wrote it, with one friction direction.
std::string of_version_3() {
  auto json = problem_io::OrderedJson::parse(to_json(scenes::push()));
  json["version"] = 3;
  json["scene"]["friction_directions"] = 1;
  return json.dump();
}

// Bytes for a generator, of many lengths.
std::string bytes(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += static_cast<char>(31 * i * i + 7 * i + count);
  return text;
}

void write_all(const std::filesystem::path& corpus) {
  write(corpus / "problem" / "everything.json", in_one_line(scenes::everything()));
  write(corpus / "problem" / "articulated.json", in_one_line(scenes::articulated()));
  write(corpus / "problem" / "planned.json", in_one_line(scenes::planned()));
  write(corpus / "problem" / "listed_rows.json", scenes::with_listed_rows(held()));
  write(corpus / "problem" / "push.json", in_one_line(scenes::push()));
  write(corpus / "problem" / "version_3.json", of_version_3());
  write(corpus / "problem" / "lift.json", in_one_line(scenes::lift(0.1)));
  write(corpus / "problem" / "drift.json", in_one_line(scenes::drift()));
  write(corpus / "problem" / "meshes.json", in_one_line(with_meshes()));
  write(corpus / "problem" / "mesh_file.json", with_mesh_file());
  write(corpus / "mesh" / "mug.obj", problem_io::write_mesh(scenes::mug()));
  write(corpus / "mesh" / "corner.obj", "# a\no a b\nv 0 0 0\nv 1 0 0\r\nv 0 1 0\nv 0 0 1\nf 1 2 3\nvn 0 0 1\n");
  for (int count = 4; count < 600; count += count / 2) {
    write(corpus / "region" / std::to_string(count), bytes(count));
  }
}

}  // namespace
}  // namespace energymargin

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "fuzz_seeds FOLDER\n";
    return 2;
  }
  std::filesystem::remove_all(arguments[1]);  // what a run before has left there
  energymargin::write_all(arguments[1]);
}

// Shapes from JSON, and meshes from the files that it names.

#include <filesystem>

#include "energymargin/problem_io.hpp"
#include "problem_io/files.hpp"
#include "problem_io/mesh.hpp"
#include "problem_io/read_record.hpp"
#include "scene/shape_records.hpp"
#include "scene/solids.hpp"

namespace energymargin::problem_io {
namespace {

Compound read_mesh_file(const JsonNode& node, const std::string& folder) {
  const std::filesystem::path file = node.text();
  const bool ends_early = file.native().find('\0') != std::string::npos;  // for the system, which would open another
  if (file.empty() || ends_early) node.fail("the path of an OBJ file");
  if (file.is_relative() && folder.empty()) {
    node.fail("an absolute path, or the folder that it is relative to: this text is of no file");
  }
  const std::string path = (folder / file).lexically_normal().string();
  std::error_code ignored;
  if (std::filesystem::is_other(std::filesystem::status(path, ignored))) {
    node.fail("a file: this is a device or a pipe, which may have no end");
  }
  try {
    return read_mesh(read_file("mesh file", path));
  } catch (const FileError& error) {
    throw std::invalid_argument(node.path() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(node.path() + ": mesh file '" + path + "': " + error.what());
  }
}

// The solid that the type names, if it names one.
std::optional<Solid> read_solid_of(const std::string& type, const JsonNode& node) {
  std::optional<Solid> solid;
  visit_types<Solid>([&](auto alternative) {
    using Alternative = typename decltype(alternative)::type;
    if (type == Record<Alternative>::type) solid = RecordReader().record<Alternative>(node);
  });
  return solid;
}

std::string solids() { return alternatives(quoted_types<Solid>(), ""); }

}  // namespace

Solid read_solid(const JsonNode& node) {
  const auto solid = read_solid_of(node["type"].text(), node);
  if (!solid) node["type"].fail(solids());
  return *solid;
}

Shape read_shape(const JsonNode& node, const std::string& folder) {
  const std::string type = node["type"].text();
  if (type == Record<Plane>::type) return RecordReader().record<Plane>(node);
  if (type == Record<Compound>::type) return RecordReader().record<Compound>(node);
  if (type == Record<MeshShape>::type) {
    const MeshShape mesh = RecordReader().record<MeshShape>(node);
    Compound compound = read_mesh_file(node["file"], folder);
    compound.solid = mesh.solid;
    return compound;
  }
  const auto solid = read_solid_of(type, node);
  if (!solid) node["type"].fail("\"plane\", \"compound\", \"mesh\", " + solids());
  return std::visit([](const auto& shape) { return Shape(shape); }, *solid);
}

}  // namespace energymargin::problem_io

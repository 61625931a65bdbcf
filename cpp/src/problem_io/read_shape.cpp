// Shapes from JSON, and meshes from the files that it names.

#include <filesystem>

#include "energymargin/problem_io.hpp"
#include "problem_io/files.hpp"
#include "problem_io/mesh.hpp"
#include "problem_io/read.hpp"

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
  return compound;
}

Compound read_mesh_file(const Place& place, const std::string& folder) {
  const std::filesystem::path file = place.word();
  const bool ends_early = file.native().find('\0') != std::string::npos;  // for the system, which would open another
  if (file.empty() || ends_early) place.fail("the path of an OBJ file");
  if (file.is_relative() && folder.empty()) {
    place.fail("an absolute path, or the folder that it is relative to: this text is of no file");
  }
  const std::string path = (folder / file).lexically_normal().string();
  std::error_code ignored;
  if (std::filesystem::is_other(std::filesystem::status(path, ignored))) {
    place.fail("a file: this is a device or a pipe, which may have no end");
  }
  try {
    return read_mesh(read_file("mesh file", path));
  } catch (const FileError& error) {
    throw std::invalid_argument(place.path() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(place.path() + ": mesh file '" + path + "': " + error.what());
  }
}

Compound read_mesh_shape(const Place& place, const std::string& folder) {
  place.only({"type", "file", "solid"});
  return read_mesh_file(place["file"], folder);
}

}  // namespace

Shape read_shape(const Place& place, const std::string& folder) {
  const std::string type = place["type"].word();
  if (type == "plane") {
    place.only({"type", "normal", "offset"});
    return Plane{place["normal"].vector3(), place["offset"].number()};
  }
  if (type == "compound" || type == "mesh") {
    Compound compound = type == "mesh" ? read_mesh_shape(place, folder) : read_compound(place);
    if (place.has("solid")) compound.solid = read_mass_properties(place["solid"]);
    return compound;
  }
  if (type != "box" && type != "sphere" && type != "cylinder" && type != "capsule" && type != "convex_hull") {
    place["type"].fail(std::string("\"plane\", \"compound\", \"mesh\", ") + solids);
  }
  return std::visit([](auto&& solid) { return Shape(std::move(solid)); }, read_solid(place));
}

}  // namespace energymargin::problem_io

#pragma once
// Compounds of convex hulls as OBJ files: one object for each part. Numbers keep all their bits.

#include <optional>
#include <string>

#include "base/record.hpp"
#include "base/words.hpp"
#include "energymargin/problem_io.hpp"
#include "energymargin/shape.hpp"

namespace energymargin::problem_io {

//! Whether an OBJ file holds all that there is to the parts: hulls alone, none of them moved.
bool fits_mesh(const Compound& compound);

//! OBJ text with the points of each part, all of them, and faces for who looks at it.
std::string write_mesh(const Compound& compound);

//! The hulls of each object's points. Throws std::invalid_argument that names the line, or the part and its line.
Compound read_mesh(const std::string& text);

//! A compound in a problem file whose parts are in an OBJ file.
struct MeshShape {
  std::string file;  //!< its path
  std::optional<MassProperties> solid{};
};

}  // namespace energymargin::problem_io

namespace energymargin {

template <>
struct Words<Meshes> {
  static constexpr std::pair<const char*, Meshes> all[]{{"embedded", Meshes::embedded}, {"files", Meshes::files}};
};

constexpr auto describe(Type<problem_io::MeshShape>) {
  return Alternative{
      "mesh", "A compound of convex hulls from an OBJ file.",
      Field{"file", &problem_io::MeshShape::file,
            "Path of an OBJ file in [m], relative to this file or absolute, with one object (a line \"o name\") for "
            "each convex part. A part is the hull of its points; faces, normals and textures do not count."},
      Field{"solid", &problem_io::MeshShape::solid,
            "Of the solid that the parts stand for; unset: those of the parts together.", Presence::optional}};
}

}  // namespace energymargin

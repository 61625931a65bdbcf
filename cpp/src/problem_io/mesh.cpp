#include "problem_io/mesh.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "energymargin/problem_io.hpp"
#include "problem_io/files.hpp"
#include "problem_io/records.hpp"
#include "scene/body_constants.hpp"

namespace energymargin::problem_io {
namespace {

constexpr std::size_t longest_line = 4096;

// What they say is of no use here: faces, looks, and which texture is where.
constexpr std::array<std::string_view, 7> skipped{"f", "vn", "vt", "s", "usemtl", "mtllib", "l"};

template <typename Vector>
bool same_bits(const Vector& a, const Vector& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

bool unmoved(const Pose& pose) {
  return same_bits(pose.position, Pose{}.position) && same_bits(pose.orientation.coeffs(), Pose{}.orientation.coeffs());
}

void append(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(" ").append(digits.data(), end);
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> list;
  for (std::size_t start = 0; start < line.size();) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", start), line.size());
    if (end > start) list.push_back(line.substr(start, end - start));
    start = end + 1;
  }
  return list;
}

double number(std::string_view word) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool read = error == std::errc() && end == word.data() + word.size();
  if (!read || !std::isfinite(value)) throw std::invalid_argument("three finite numbers after v");
  return value;
}

class MeshReader {
 public:
  void read(std::string_view line) {
    ++line_;
    try {
      if (line.size() > longest_line) {
        throw std::invalid_argument("at most " + std::to_string(longest_line) + " characters in a line");
      }
      const std::vector<std::string_view> line_words = words(line);
      if (line_words.empty() || line_words[0].front() == '#') return;
      if (line_words[0] == "o") {
        parts_.push_back({rest(line_words), line_, {}});
      } else if (line_words[0] == "v") {
        add_point(line_words);
      } else if (std::find(skipped.begin(), skipped.end(), line_words[0]) == skipped.end()) {
        throw std::invalid_argument("a line that begins with o, v, vn, vt, f, l, s, usemtl, mtllib or #");
      }
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("line " + std::to_string(line_) + " is " + in_quotes(std::string(line)) +
                                  ", expected " + error.what());
    }
  }

  Compound take() {
    if (parts_.empty())
      throw std::invalid_argument("no convex part, expected a line \"o name\" before the points of each");
    Compound compound;
    for (NamedHull& part : parts_) {
      at_place("part " + in_quotes(part.name) + " of line " + std::to_string(part.line) + ": ",
               [&] { validate(part.hull); });
      compound.parts.push_back({std::move(part.hull), {}});
    }
    return compound;
  }

 private:
  struct NamedHull {
    std::string name;
    int line;  // where it begins
    ConvexHull hull;
  };

  // What follows a line's first word.
  static std::string rest(const std::vector<std::string_view>& line_words) {
    return line_words.size() == 1
               ? ""
               : std::string(line_words[1].data(), line_words.back().data() + line_words.back().size());
  }

  void add_point(const std::vector<std::string_view>& line_words) {
    if (parts_.empty()) throw std::invalid_argument("a line \"o name\" before the points of each convex part");
    if (line_words.size() != 4) throw std::invalid_argument("three finite numbers after v");
    parts_.back().hull.points.emplace_back(number(line_words[1]), number(line_words[2]), number(line_words[3]));
  }

  std::vector<NamedHull> parts_;
  int line_ = 0;
};

}  // namespace

bool fits_mesh(const Compound& compound) {
  return !compound.parts.empty() && std::all_of(compound.parts.begin(), compound.parts.end(), [](const Part& part) {
    return std::holds_alternative<ConvexHull>(part.shape) && unmoved(part.pose);
  });
}

std::string write_mesh(const Compound& compound) {
  std::string text = "# Convex parts, each the hull of its points [m].\n";
  std::size_t first = 1;  // an OBJ file counts all its points, from 1
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    const std::vector<Vector3>& points = std::get<ConvexHull>(compound.parts[i].shape).points;
    text += "o part_" + std::to_string(i) + "\n";
    for (const Vector3& point : points) {
      text += "v";
      for (const double value : point) append(text, value);
      text += "\n";
    }
    for (const auto& [a, b, c] : hull_faces(points)) {
      text +=
          "f " + std::to_string(first + a) + " " + std::to_string(first + b) + " " + std::to_string(first + c) + "\n";
    }
    first += points.size();
  }
  return text;
}

Compound read_mesh(const std::string& text) {
  MeshReader reader;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    reader.read(std::string_view(text).substr(start, end - start));
    start = end + 1;
  }
  return reader.take();
}

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

}  // namespace energymargin::problem_io

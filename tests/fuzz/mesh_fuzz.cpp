// Any text of an OBJ file is a mesh or std::invalid_argument; a mesh keeps its bits in a file.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "problem_io/mesh.hpp"
#include "require.hpp"

namespace energymargin::fuzz {
namespace {

std::optional<Compound> read(const std::string& text) {
  try {
    return problem_io::read_mesh(text);
  } catch (const std::invalid_argument& error) {
    require(error.what()[0] != '\0', "an error says what is wrong");
    return std::nullopt;
  }
}

}  // namespace
}  // namespace energymargin::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace energymargin;
  const auto mesh = fuzz::read(std::string(reinterpret_cast<const char*>(data), size));
  if (!mesh) return 0;
  validate(*mesh);
  fuzz::require(problem_io::fits_mesh(*mesh), "what was a mesh fits one");
  const std::string text = problem_io::write_mesh(*mesh);
  fuzz::require(problem_io::write_mesh(problem_io::read_mesh(text)) == text, "a mesh is read back as it was");
  return 0;
}

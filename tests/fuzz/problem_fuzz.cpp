// Any text is a problem or std::invalid_argument; a problem keeps its bits in JSON, and can be simulated.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "energymargin/problem_io.hpp"
#include "json_mutator.hpp"
#include "problem_io/json.hpp"
#include "require.hpp"

namespace energymargin::fuzz {
namespace {

using problem_io::Json;

// Absolute paths are allowed in a problem file, and what is behind them is another one on each machine.
bool leaves_the_folder(const Json& body) {
  if (!body.is_object() || !body.contains("shape") || !body["shape"].is_object()) return false;
  const Json& shape = body["shape"];
  return shape.contains("file") && shape["file"].is_string() &&
         shape["file"].get<std::string>().find('/') != std::string::npos;
}

bool names_other_files(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("scene") || !json["scene"].is_object()) return false;
  if (!json["scene"].contains("bodies") || !json["scene"]["bodies"].is_array()) return false;
  for (const Json& body : json["scene"]["bodies"]) {
    if (leaves_the_folder(body)) return true;
  }
  return false;
}

std::optional<Problem> read(const std::string& text) {
  try {
    return from_json(text, ENERGYMARGIN_MESHES);
  } catch (const std::invalid_argument& error) {
    require(error.what()[0] != '\0', "an error says what is wrong");
    return std::nullopt;
  }
}

void require_written_and_read_back(const Problem& problem) {
  const std::string text = to_json(problem);
  require(to_json(from_json(text)) == text, "what is written is read back as it was");
}

void require_simulated(const Problem& problem) {
  World world = problem.plan ? World(problem.scene, *problem.plan) : World(problem.scene);
  const Disturbance wrenches(problem.scene.with_role(Role::object).size(), Wrench{problem.force, problem.torque});
  try {
    const Rollout rollout = world.rollout(problem.state, wrenches, 2.0 * problem.scene.stepping().step);
    require(rollout.state.allFinite(), "a simulation ends with finite numbers");
  } catch (const std::invalid_argument& error) {
    require(false, std::string("a problem can be simulated: ") + error.what());
  } catch (const std::runtime_error&) {  // it diverges
  }
}

}  // namespace
}  // namespace energymargin::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace energymargin::fuzz;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (names_other_files(text)) return 0;
  const auto problem = read(text);
  if (!problem) return 0;
  require_written_and_read_back(*problem);
  require_simulated(*problem);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  return energymargin::fuzz::mutate_json(data, size, most, seed);
}

#include "energymargin/problem_io.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "problem_io/json.hpp"

namespace energymargin {
namespace {

// Far more than a problem needs, and far less than a stack holds.
constexpr int most_depth = 256;

}  // namespace

std::string to_json(const Problem& problem) {
  validate(problem);
  return problem_io::write_problem(problem).dump(1) + "\n";
}

Problem from_json(const std::string& text) {
  using problem_io::Json;
  const auto limit_depth = [](int depth, Json::parse_event_t, Json&) {
    if (depth > most_depth) {
      throw std::invalid_argument("more than " + std::to_string(most_depth) + " levels of lists and objects");
    }
    return true;
  };
  Json json;
  try {
    json = Json::parse(text, limit_depth);
  } catch (const Json::out_of_range& error) {
    throw std::invalid_argument(std::string("a number beyond all bounds: ") + error.what());
  } catch (const Json::parse_error& error) {
    throw std::invalid_argument("not valid JSON, or cut off, at byte " + std::to_string(error.byte) + " of " +
                                std::to_string(text.size()));
  }
  Problem problem = problem_io::read_problem(json);
  validate(problem);
  return problem;
}

void save(const Problem& problem, const std::string& path) {
  const std::string text = to_json(problem);
  const std::string partial = path + ".part";
  {
    std::ofstream file(partial, std::ios::binary);
    file << text << std::flush;
    if (!file) {
      std::remove(partial.c_str());
      throw FileError("cannot write '" + path + "'");
    }
  }
  if (std::rename(partial.c_str(), path.c_str()) != 0) {
    std::remove(partial.c_str());
    throw FileError("cannot write '" + path + "'");
  }
}

Problem load(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw FileError("problem file '" + path + "' cannot be opened");
  std::ostringstream text;
  text << file.rdbuf();
  if (!file || text.str().empty())
    throw std::invalid_argument("problem file '" + path + "' cannot be read or is empty");
  try {
    return from_json(text.str());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("problem file '" + path + "': " + error.what());
  }
}

}  // namespace energymargin

// energymargin_score: reads a problem file, and prints its score as JSON or writes the file again.

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "options.hpp"
#include "scores.hpp"

namespace {

using energymargin::app::Arguments;

bool has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// An error or a warning is one line; a name in the file may have several.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

void warn(const std::vector<energymargin::Warning>& warnings) {
  for (const energymargin::Warning& warning : warnings) std::cerr << "warning: " << one_line(warning.text) << "\n";
}

// Scores or saves the problem, and returns what to print.
std::string run(const Arguments& arguments) {
  std::vector<energymargin::Warning> outdated;
  energymargin::Problem problem = energymargin::load(arguments.file, &outdated);
  if (arguments.engine) problem = energymargin::with_engine(problem, *arguments.engine);
  warn(outdated);
  if (!arguments.copy.empty()) {
    energymargin::save(problem, arguments.copy, arguments.meshes);
    return "";
  }
  warn(energymargin::implausible(problem));
  const energymargin::app::Score score = energymargin::app::score(problem, arguments);
  warn(score.warnings);
  return score.json.dump(1) + "\n";
}

std::string answer(const std::vector<std::string>& words) {
  if (has(words, "--help") || has(words, "-h")) return energymargin::app::help();
  if (has(words, "--schema")) return energymargin::problem_schema();
  return run(energymargin::app::parse(words));
}

void print(const std::string& text) {
  std::cout << text << std::flush;
  if (!std::cout) throw std::runtime_error("the output cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    print(answer({argv + 1, argv + argc}));
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "error: " << one_line(error.what()) << "\n";
    return 2;
  }
}
